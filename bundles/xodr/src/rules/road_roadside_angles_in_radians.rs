use std::f64::consts::TAU;

use crate::families::object_parts::{named, number};
use crate::families::on_road::OnRoad;
use crate::families::roadside::{place, things};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[LARGE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const LARGE: Param = Param::number(
    "large",
    100.0,
    "rad",
    "an angle beyond this counts as degrees, even if it is not a round number",
);

const ANGLES: [&str; 4] = ["hOffset", "hdg", "pitch", "roll"];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let large = found.number(&LARGE);
    for road in map.part(part).roads() {
        for thing in things(road) {
            for (name, angle) in ANGLES
                .iter()
                .filter_map(|name| in_degrees(thing, name, large))
            {
                let text = format!(
                    "`{name}` of {} is {angle}, which is {:.1} full turns; angles are in radians ({angle}° = \
                     {:.4})",
                    named(thing),
                    angle.abs() / TAU,
                    angle.to_radians()
                );
                let finding = found.issue(Place::attribute_or_node(thing, name), text);
                if let Some((s, t)) = place(thing, road) {
                    finding.on(road, s, t);
                }
            }
        }
    }
}

/// Returns an angle beyond a full turn that is probably in degrees. It is a multiple of half a
/// degree, or above `large`. Other angles come from adding up turns, which is odd but harmless.
fn in_degrees<'n>(thing: Node<'_>, name: &'n str, large: f64) -> Option<(&'n str, f64)> {
    let angle = number(thing, name).filter(|angle| angle.abs() > TAU + 1e-3)?;
    let is_round = (angle * 2.0 - (angle * 2.0).round()).abs() < 1e-9;
    (is_round || angle.abs() > large).then_some((name, angle))
}

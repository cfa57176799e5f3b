use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;
use qcbus_opendrive::geometry::Minimum;

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "largest distance by which a border may lie inside an inner one",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            // If a side has widths, its borders are ignored.
            if section.has_widths(side) || !section.is_numbered(side) {
                continue;
            }
            for outer in section.side(side) {
                if let Some(inner) = outer.inner_neighbour() {
                    compare(side, inner, outer, found);
                }
            }
        }
    }
}

fn compare(side: Side, inner: LaneRef<'_, '_>, outer: LaneRef<'_, '_>, found: &mut Sink<'_>) {
    let Some(lowest) = outer
        .length()
        .and_then(|end| lowest_distance(side, inner, outer, end))
    else {
        return;
    };
    if lowest.value >= -found.number(&TOLERANCE) {
        return;
    }
    let t = |lane: LaneRef<'_, '_>| lane.borders().at(lowest.at).unwrap_or(f64::NAN);
    let text = format!(
        "the border of {} lies at t = {:.3} m, {:.6} m inside the border of lane `{}` at t = {:.3} m, {:.3} m \
         after the start of the lane section; it must not lie further inside than the border of an inner lane",
        lane_name(outer),
        t(outer),
        -lowest.value,
        inner.id_text().unwrap_or_default(),
        t(inner),
        lowest.at
    );
    let s = outer.at.s().unwrap_or(0.0) + lowest.at;
    found
        .issue(outer.node(), text)
        .on(outer.at.road, s, t(outer))
        .at(inner.node(), "the inner lane");
}

/// Returns the smallest distance of the outer border from the inner one, where both exist.
fn lowest_distance(
    side: Side,
    inner: LaneRef<'_, '_>,
    outer: LaneRef<'_, '_>,
    end: f64,
) -> Option<Minimum> {
    let inner: Vec<Stretch<'_, '_>> = inner.borders().stretches(end).collect();
    let mut rest = inner.as_slice();
    let mut lowest: Option<Minimum> = None;
    for piece in outer.borders().stretches(end) {
        while rest.first().is_some_and(|first| first.to <= piece.from) {
            rest = &rest[1..];
        }
        for other in rest.iter().take_while(|other| other.from < piece.to) {
            let (from, to) = (piece.from.max(other.from), piece.to.min(other.to));
            let cubic = piece.cubic.shifted(from - piece.from);
            let distance = cubic
                .minus(&other.cubic.shifted(from - other.from))
                .scaled(side.sign());
            let Some(least) = distance.minimum(0.0, to - from) else {
                continue;
            };
            if lowest.is_none_or(|known| least.value < known.value) {
                lowest = Some(Minimum {
                    at: from + least.at,
                    value: least.value,
                });
            }
        }
    }
    lowest
}

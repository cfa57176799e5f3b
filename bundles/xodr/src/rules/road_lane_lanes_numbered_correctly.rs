use crate::families::lane_numbers::word;
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.001,
    "m",
    "largest distance by which the border of a lane may lie on the other side of the center lane",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for section in map.part(part).sections() {
        // Borders are measured from the reference line. An offset is not allowed beside them. With
        // an offset, the position of the center is unknown.
        if section.layer.offset().is_empty() {
            for side in Side::BOTH {
                on_wrong_side(section, side, found);
            }
        }
    }
    for lane in map.part(part).lanes() {
        let (Some(side), Some(id)) = (lane.side(), lane.id()) else {
            continue;
        };
        // The rule about the center lane's id reports 0.
        if id == 0 || Side::of_lane_id(id) == Some(side) {
            continue;
        }
        let kind = match side {
            Side::Left => "positive",
            Side::Right => "negative",
        };
        let text = format!(
            "lane {id} is listed to the {} of the center lane; ids there must be {kind}",
            word(side)
        );
        found.issue(Place::attribute_or_node(lane.node(), "id"), text);
    }
}

/// Reports the innermost lane of a side if its outer border lies beyond the center lane. Another
/// rule reports outer borders that cross an inner one.
fn on_wrong_side(section: SectionRef<'_, '_>, side: Side, found: &mut Sink<'_>) {
    let first = section.side(side).next();
    let by_border = !section.has_widths(side) && section.is_numbered(side);
    let Some((lane, length)) = first
        .filter(|_| by_border)
        .and_then(|lane| lane.length().map(|it| (lane, it)))
    else {
        return;
    };
    let lowest = lane.borders().stretches(length).filter_map(|stretch| {
        let least = stretch
            .cubic
            .scaled(side.sign())
            .minimum(0.0, stretch.length())?;
        Some((least.value, stretch.from + least.at))
    });
    let worst = lowest.min_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((value, ds)) = worst.filter(|(value, _)| *value < -found.number(&TOLERANCE)) {
        let text = format!(
            "the border of {} lies on the wrong side of the center lane, at t = {:.3} m, {ds:.3} m after the \
             start of the lane section; borders of lanes to the {} must lie on that side",
            lane_name(lane),
            value * side.sign(),
            word(side)
        );
        let s = section.s().unwrap_or(0.0) + ds;
        found
            .issue(lane.node(), text)
            .on(section.road, s, value * side.sign());
    }
}

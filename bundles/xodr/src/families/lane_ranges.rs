//! Lane validity: the lanes to which an object, a signal or a structure applies.

use crate::families::object_parts::{Stands, below, named, number, owner};
use crate::prelude::*;
use qcbus_opendrive::Validity;

/// Reports validities below these elements that begin with the higher lane.
pub(crate) fn lower_comes_first(map: &RoadMap<'_>, parents: &[&'static str], found: &mut Sink<'_>) {
    for validity in parents.iter().flat_map(|name| below(map, "validity", name)) {
        let range = Validity::of(validity);
        let (Some(from), Some(to)) = (range.from_lane(), range.to_lane()) else {
            continue;
        };
        if from > to {
            let parent = owner(validity);
            let text = format!(
                "`fromLane` is {from} and higher than `toLane`, which is {to}; \
                 the range must begin with the lower lane"
            );
            found
                .issue(Place::attribute_or_node(validity, "fromLane"), text)
                .stands(map, parent);
        }
    }
}

/// Reports ranges on the side that does not match the orientation of the element. It only checks
/// roads with these traffic rules. `holders` are the elements that can have validities.
pub(crate) fn fit_orientation(
    map: &RoadMap<'_>,
    holders: &[&'static str],
    traffic: &[TrafficRule],
    uid: Option<&'static str>,
    found: &mut Sink<'_>,
) {
    for validity in holders.iter().flat_map(|name| below(map, "validity", name)) {
        let Some(road) = map.road_of(validity) else {
            continue;
        };
        let Some(rule) = road.traffic_rule().filter(|rule| traffic.contains(rule)) else {
            continue;
        };
        check(map, (road, rule), validity, uid, found);
    }
}

fn check<'a>(
    map: &RoadMap<'a>,
    (road, rule): (&Road<'a>, TrafficRule),
    validity: Node<'a>,
    uid: Option<&'static str>,
    found: &mut Sink<'_>,
) {
    let range = Validity::of(validity);
    let Some(holder) = validity
        .ancestors()
        .take_while(|above| !above.is("road"))
        .find(|above| above.attr("orientation").is_some())
    else {
        return;
    };
    let orientation = holder.attr("orientation").unwrap_or_default();
    let (Some(side), Some(from), Some(to)) = (
        side_of(orientation, rule),
        range.from_lane(),
        range.to_lane(),
    ) else {
        return;
    };
    let (low, high) = (from.min(to), from.max(to));
    let strays = match side {
        Side::Right => high > 0,
        Side::Left => low < 0,
    };
    let place = owner(validity);
    if !strays || are_all_two_way(road, range, place, (low, high), side) {
        return;
    }
    let (hand, sign) = (
        match rule {
            TrafficRule::RightHand => "right-hand",
            TrafficRule::LeftHand => "left-hand",
        },
        match side {
            Side::Right => "negative",
            Side::Left => "positive",
        },
    );
    let text = format!(
        "the validity covers the lanes {from} to {to}, but `orientation=\"{orientation}\"` of {} on a road with \
         {hand} traffic allows only {sign} lane ids; for lanes of both sides `orientation` must be `none`",
        named(holder)
    );
    let mut finding = found.issue(validity, text).stands(map, place);
    if !has_lanes(road, range, place, side) {
        finding = finding.level(Level::Warning);
    }
    let finding = finding.at(
        Place::attribute_or_node(holder, "orientation"),
        "the orientation",
    );
    if let Some(uid) = uid {
        finding.uid(uid);
    }
}

/// Returns the side of the traffic for an orientation, or `None` for both sides.
fn side_of(orientation: &str, rule: TrafficRule) -> Option<Side> {
    match (orientation, rule) {
        ("+", TrafficRule::RightHand) | ("-", TrafficRule::LeftHand) => Some(Side::Right),
        ("-", TrafficRule::RightHand) | ("+", TrafficRule::LeftHand) => Some(Side::Left),
        _ => None,
    }
}

/// Checks whether the range has lanes on the other side and all of them may be driven against the
/// usual direction.
fn are_all_two_way<'a>(
    road: &Road<'a>,
    range: Validity<'a>,
    place: Node<'a>,
    (low, high): (i64, i64),
    side: Side,
) -> bool {
    let other = match side {
        Side::Right => Side::Left,
        Side::Left => Side::Right,
    };
    let Some(section) = section_of(road, range, place, other) else {
        return false;
    };
    let mut any = false;
    let all = section
        .side(other)
        .filter(|lane| lane.id().is_some_and(|id| (low..=high).contains(&id)))
        .inspect(|_| any = true)
        .all(|lane| {
            matches!(lane.direction(), Some("reversed" | "both"))
                || lane.kind() == Some("bidirectional")
        });
    all && any
}

/// Checks whether the road has lanes on a side at the element. The default is true.
fn has_lanes<'a>(road: &Road<'a>, range: Validity<'a>, place: Node<'a>, side: Side) -> bool {
    section_of(road, range, place, side).is_none_or(|section| section.side(side).next().is_some())
}

/// Returns the lane section for a side at the position of the element.
fn section_of<'m, 'a>(
    road: &'m Road<'a>,
    range: Validity<'a>,
    place: Node<'a>,
    side: Side,
) -> Option<SectionRef<'m, 'a>> {
    let kind = Some(range.layer()).filter(|kind| *kind != LayerKind::Unknown)?;
    let layer = road.layer(kind)?;
    layer.section_at(road, side, number(place, "s")?)
}

use crate::families::driving::is_drivable;
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_stretches::NO_WIDTH;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(layer) = road.layer(LayerKind::Temporary) else {
            continue;
        };
        for lane in layer.in_order(road).flat_map(|section| section.lanes()) {
            for end in ContactPoint::BOTH {
                if begins_or_ends(lane, end) || is_alone_at_end(map, lane, end) {
                    check(lane, end, found);
                }
            }
        }
    }
}

/// Checks whether the temporary lanes begin or end here. That means that no other temporary section
/// touches this end and the road continues.
fn begins_or_ends(lane: LaneRef<'_, '_>, end: ContactPoint) -> bool {
    let (Some(side), Some(start)) = (lane.side(), lane.at.s()) else {
        return false;
    };
    let Some(stop) = lane.at.end(side) else {
        return false;
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-3;
    let (inside, touches) = match end {
        ContactPoint::Start => {
            let before = lane.at.previous(side).and_then(|one| one.end(side));
            (
                start > 1e-3,
                before.is_some_and(|before| near(before, start)),
            )
        }
        ContactPoint::End => {
            let after = lane.at.next(side).and_then(|one| one.s());
            let length = lane.at.road.length();
            (
                length.is_some_and(|length| stop < length - 1e-3),
                after.is_some_and(|after| near(after, stop)),
            )
        }
    };
    inside && !touches
}

/// Checks whether the temporary lane reaches the end of its road. The linked road must have no
/// temporary lanes to continue it.
fn is_alone_at_end<'a>(map: &RoadMap<'a>, lane: LaneRef<'_, 'a>, end: ContactPoint) -> bool {
    let (Some(side), Some(contact)) = (lane.side(), map.linked_end(lane.at.road, end)) else {
        return false;
    };
    let Some(road) = map.road_at(contact.to.road) else {
        return false;
    };
    let section = road
        .layer(LayerKind::Temporary)
        .and_then(|layer| layer.end_section(road, side, contact.to.end));
    let reaches = |section: SectionRef<'_, '_>| match contact.to.end {
        ContactPoint::Start => section.s().is_some_and(|s| s <= 1e-3),
        ContactPoint::End => {
            let ends = section.end(side).zip(road.length());
            ends.is_some_and(|(stop, length)| stop >= length - 1e-3)
        }
    };
    lane.is_at_road_end(end) && !section.is_some_and(reaches)
}

fn check(lane: LaneRef<'_, '_>, end: ContactPoint, found: &mut Sink<'_>) {
    let wide = lane.width_at(end).is_some_and(|width| width > NO_WIDTH);
    let mut links = lane.links(end);
    if !wide || !is_drivable(lane) || links.any(|link| link.layer() == LayerKind::Permanent) {
        return;
    }
    let text = format!(
        "{} has no `{}` on the permanent layer at the {end} of the temporary lanes; without one, vehicles cannot \
         {} it",
        lane_name(lane),
        end.link_name(),
        match end {
            ContactPoint::Start => "get onto",
            ContactPoint::End => "leave",
        }
    );
    found.issue(lane.node(), text).at_lane_end(lane, end);
}

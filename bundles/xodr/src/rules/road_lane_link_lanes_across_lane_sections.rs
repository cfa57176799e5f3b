use crate::families::driving::is_drivable;
use crate::families::faults::OfFault as _;
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;
use qcbus_opendrive::LaneSpan;
use qcbus_sdk::fault_of;

const OVERLAP: Param = Param::number(
    "overlap",
    0.5,
    "",
    "fraction of the narrower lane's width that two lanes must share to count as one lane",
);

/// UID in the spelling of annex F, for findings without a counterpart in ASAM's checker.
const ANNEX_F: &str = "asam.net:xodr:1.4.0:road.lane.link.lanes_across_laneSections";

/// Minimum width of lanes that count as continuing, in metres.
const NARROW: f64 = 0.1;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::by_case(
        "a missing link harms only between lanes that vehicles drive on",
    )),
    uids: &[
        // ASAM's checker prints this UID.
        "asam.net:xodr:1.4.0:road.lane.link.lanes_across_lane_sections",
        ANNEX_F,
    ],
    versions: "1.4.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[OVERLAP],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    not_returned(map.part(part), found);
    for section in map.part(part).sections() {
        for side in Side::BOTH {
            not_linked_at_all(section, side, found);
        }
    }
}

/// Reports lanes that continue in the next section by position, width and type without any link
/// across the boundary.
fn not_linked_at_all(section: SectionRef<'_, '_>, side: Side, found: &mut Sink<'_>) {
    let Some((next, length)) = section.next(side).zip(section.length(side)) else {
        return;
    };
    let (end, start) = (ContactPoint::End, ContactPoint::Start);
    let open = |lane: LaneRef<'_, '_>, end| is_drivable(lane) && lane.links(end).next().is_none();
    let mut ends = section.spans(side, Station::before(length));
    let mut starts = next.spans(side, 0.0);
    ends.retain(|span| open(span.lane, end));
    starts.retain(|span| open(span.lane, start));
    for from in &ends {
        let goes_on = |to: &&LaneSpan<'_, '_>| {
            from.lane.kind() == to.lane.kind() && overlap(from, to) >= found.number(&OVERLAP)
        };
        let Some(to) = starts.iter().find(goes_on) else {
            continue;
        };
        let text = format!(
            "{} continues as {}, but neither lane links to the other; lanes that continue must be linked in both \
             directions",
            lane_name(from.lane),
            lane_name(to.lane)
        );
        found
            .issue(from.lane.node(), text)
            .level(Level::Warning)
            .uid(ANNEX_F)
            .at_lane_end(from.lane, end)
            .at(to.lane.node(), "the lane that continues it")
            .follows(fault_of(next.node()));
    }
}

/// Returns the overlap of two lanes as a fraction of the narrower width, or zero without width.
fn overlap(one: &LaneSpan<'_, '_>, other: &LaneSpan<'_, '_>) -> f64 {
    let range = |span: &LaneSpan<'_, '_>| (span.inner.min(span.outer), span.inner.max(span.outer));
    let ((low, high), (from, to)) = (range(one), range(other));
    let narrower = (high - low).min(to - from);
    if narrower < NARROW {
        return 0.0;
    }
    (high.min(to) - low.max(from)) / narrower
}

fn not_returned(part: MapPart<'_, '_>, found: &mut Sink<'_>) {
    let map = part.map();
    for joint in part.roads().iter().flat_map(|road| map.joints_of(road)) {
        let (Some(from), Some(to)) = (map.lane(joint.from.lane), map.lane(joint.to.lane)) else {
            continue;
        };
        if !demands_link_back(map, joint, from, to) || links_back(map, joint, from, to) {
            continue;
        }
        // Only traffic that leaves the lane there needs its link.
        let leaves = Traffic::of(to).may_run_towards(joint.to.end);
        let harm = match leaves && is_drivable(from) && is_drivable(to) {
            true => Level::Error,
            false => Level::Warning,
        };
        let back = joint.to.end.link_name();
        let text = format!(
            "{} has {} as its {}, which does not have {} as its {back}; lanes that continue must be linked in both \
             directions",
            lane_name(from),
            lane_name(to),
            joint.from.end.link_name(),
            lane_name(from)
        );
        found
            .issue(to.node(), text)
            .here(&what_it_says(map, joint, from, to))
            .at_lane_end(to, joint.to.end)
            .at(joint.node, "the link that has no link back")
            .at_joint([(from, joint.from.end), (to, joint.to.end)])
            .readers_level(harm);
    }
}

/// Describes the links of a lane that does not link back. The right number may lead to the wrong
/// end.
fn what_it_says<'a>(
    map: &RoadMap<'a>,
    joint: &LaneJoint<'a>,
    from: LaneRef<'_, 'a>,
    to: LaneRef<'_, 'a>,
) -> String {
    let end = joint.to.end;
    let (back, id) = (end.link_name(), from.id_text().unwrap_or_default());
    let mut links = to.links(end);
    let leads = links.any(|link| link.id().is_some() && link.id() == from.id());
    let target = map.linked_end(to.at.road, end).map(|contact| contact.to);
    match target.and_then(|target| Some((target.end, map.road_at(target.road)?))) {
        Some((other, road)) if leads && !joint.is_within_road() => format!(
            "its {back} `{id}` leads to the {other} of road `{}` (`contactPoint`), not back to this end",
            road.id()
        ),
        _ => format!("has no `{back}` with the id `{id}`"),
    }
}

/// Checks whether a lane must link back. Connecting roads have links on one side only, because the
/// roads around a junction link to the junction. The same applies to every end with a link to a
/// junction.
fn demands_link_back<'a>(
    map: &RoadMap<'a>,
    joint: &LaneJoint<'a>,
    from: LaneRef<'_, 'a>,
    to: LaneRef<'_, 'a>,
) -> bool {
    if joint.is_within_road() {
        return true;
    }
    let roads = [from.at.road, to.at.road];
    let link = to.at.road.link(joint.to.end);
    roads.iter().all(|road| road.junction().is_none())
        && link.is_none_or(|link| {
            link.road_id()
                .and_then(|id| map.road(id))
                .map(|road| road.index())
                == Some(from.at.road.index())
        })
}

fn links_back<'a>(
    map: &RoadMap<'a>,
    joint: &LaneJoint<'a>,
    from: LaneRef<'_, 'a>,
    to: LaneRef<'_, 'a>,
) -> bool {
    to.links(joint.to.end).any(|link| {
        let target = link
            .id()
            .and_then(|id| map.linked_lane(to, joint.to.end, id, link.layer()));
        match target {
            Some(target) => target.lane == from.key(),
            // If the road has no link or no contact point there, only the number can be compared.
            None => link.id() == from.id() && map.linked_end(to.at.road, joint.to.end).is_none(),
        }
    })
}

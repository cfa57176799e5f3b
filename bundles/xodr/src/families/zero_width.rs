//! Lanes without width at a link (OpenDRIVE 1.9, 11.6).

use super::faults::OfFault as _;
use super::on_road::{MAX_PLACES, OnRoad, lane_name};
use crate::prelude::*;
use foldhash::HashMap;

/// Width up to which a lane counts as having none.
pub(crate) const ZERO_WIDTH: Param = Param::number(
    "zero_width",
    0.001,
    "m",
    "lanes up to this width count as having a width of zero",
);

/// Checks for zero width at an end of the section. Separate rules check negative widths.
pub(crate) fn is_zero_at(lane: LaneRef<'_, '_>, end: ContactPoint, zero: f64) -> bool {
    lane.side().is_some() && lane.width_at(end).is_some_and(|width| width.abs() <= zero)
}

/// Checks whether a lane has some width in its section. It checks both ends, and the start and the
/// middle of each record.
pub(crate) fn opens(lane: LaneRef<'_, '_>, zero: f64) -> bool {
    let wide = |ds: f64| lane.width(ds).is_some_and(|width| width > zero);
    let Some(length) = lane.length() else {
        return false;
    };
    let profiles = [lane.widths(), lane.borders()];
    let mut stretches = profiles
        .into_iter()
        .flat_map(|profile| profile.stretches(length));
    ContactPoint::BOTH
        .iter()
        .filter_map(|end| lane.width_at(*end))
        .any(|width| width > zero)
        || stretches.any(|stretch| wide(stretch.from) || wide(0.5 * (stretch.from + stretch.to)))
}

/// Reports lanes without width at `end` that are linked there: by their own links, or by lane links
/// of a junction that start at them or lead to them.
pub(crate) fn has_no_links(map: &RoadMap<'_>, end: ContactPoint, found: &mut Sink<'_>) {
    let zero = found.number(&ZERO_WIDTH);
    let junctions = LaneLinks::of(map, end);
    for lane in map.lanes().filter(|lane| is_zero_at(*lane, end, zero)) {
        let at = LaneEnd::of(lane, end);
        let own: Vec<Node<'_>> = lane.links(end).map(|link| link.node()).collect();
        let own_text = format!("it must not have a `{}`", end.link_name());
        report(lane, end, &own, &own_text, found);
        let text = "no lane link of a junction may start there";
        report(lane, end, junctions.from(at), text, found);
        let text = "no lane link of a junction may lead there";
        report(lane, end, junctions.to(at), text, found);
    }
}

fn report(
    lane: LaneRef<'_, '_>,
    end: ContactPoint,
    links: &[Node<'_>],
    demand: &str,
    found: &mut Sink<'_>,
) {
    if links.is_empty() {
        return;
    }
    let text = format!(
        "{} has no width at the {end} of its lane section ({:.4} m); {demand}",
        lane_name(lane),
        lane.width_at(end).map_or(0.0, f64::abs)
    );
    let mut finding = found
        .issue(lane.node(), text)
        .at_lane_end(lane, end)
        .at_opening(lane, end);
    for link in links.iter().take(MAX_PLACES) {
        finding = finding.at(*link, "the link");
    }
}

/// The lane links of junctions by the lane ends that they join.
#[derive(Default)]
struct LaneLinks<'a> {
    from: HashMap<LaneEnd, Vec<Node<'a>>>,
    to: HashMap<LaneEnd, Vec<Node<'a>>>,
}

impl<'a> LaneLinks<'a> {
    fn of(map: &RoadMap<'a>, end: ContactPoint) -> LaneLinks<'a> {
        let mut links = LaneLinks::default();
        for joint in map.junction_joints() {
            for (side, at) in [(&mut links.from, joint.from), (&mut links.to, joint.to)] {
                if at.end == end {
                    side.entry(at).or_default().push(joint.node);
                }
            }
        }
        links
    }

    fn from(&self, at: LaneEnd) -> &[Node<'a>] {
        self.from.get(&at).map_or(&[], Vec::as_slice)
    }

    fn to(&self, at: LaneEnd) -> &[Node<'a>] {
        self.to.get(&at).map_or(&[], Vec::as_slice)
    }
}

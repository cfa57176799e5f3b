use crate::families::driving::is_drivable;
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::{self, NARROW, is_route};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    params: &[NARROW],
    run,
    ..Rule::after(READABLE)
};

/// Types of lanes on which no vehicle drives, independent of the lanes before and after them.
const FOR_OTHERS: &[&str] = &["sidewalk", "walking", "curb", "median", "rail", "tram"];

/// Types of lanes that may lie before or behind a lane for vehicles, but not between two of them.
const ASIDE: &[&str] = &[
    "none",
    "restricted",
    "border",
    "biking",
    "shoulder",
    "stop",
    "parking",
];

/// Maximum number of lanes in a row that are followed.
const MOST_IN_A_ROW: usize = 64;

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    between_lanes_for_vehicles(map, found);
    let mut told = HashSet::default();
    for joint in map.lane_joints() {
        let lanes = map.lane(joint.from.lane).zip(map.lane(joint.to.lane));
        let Some((from, to)) = lanes.filter(|(from, to)| from.kind() != to.kind()) else {
            continue;
        };
        let clash = (is_route(from) && is_for_others(to))
            || (is_route(to) && is_for_others(from))
            || runs_onto_shoulder(joint.from, from, to)
            || runs_onto_shoulder(joint.to, to, from);
        if !clash || !is_wide(joint, from, to, found.number(&NARROW)) {
            continue;
        }
        if !told.insert((joint.from.min(joint.to), joint.from.max(joint.to))) {
            continue;
        }
        let text = format!(
            "{}, a lane of type `{}`, continues as {}, which has type `{}`; a lane for vehicles should not \
             continue as a lane that is not for vehicles, or the reverse",
            lane_name(from),
            from.kind().unwrap_or_default(),
            lane_name(to),
            to.kind().unwrap_or_default()
        );
        found
            .issue(joint.node, text)
            .at_lane_end(from, joint.from.end)
            .at(to.node(), "the linked lane");
    }
}

fn is_for_others(lane: LaneRef<'_, '_>) -> bool {
    lane.kind().is_some_and(|kind| FOR_OTHERS.contains(&kind))
}

/// Checks whether vehicles that follow a lane to this end continue on a shoulder.
fn runs_onto_shoulder(end: LaneEnd, from: LaneRef<'_, '_>, to: LaneRef<'_, '_>) -> bool {
    let leaves = Traffic::of(from).may_run_towards(end.end);
    leaves && is_route(from) && to.kind() == Some("shoulder")
}

fn is_wide(joint: &LaneJoint<'_>, from: LaneRef<'_, '_>, to: LaneRef<'_, '_>, narrow: f64) -> bool {
    let widths = [from.width_at(joint.from.end), to.width_at(joint.to.end)];
    widths
        .into_iter()
        .all(|width| width.is_some_and(|it| it >= narrow))
}

/// Reports lanes for others that lead from one lane for vehicles to another one.
fn between_lanes_for_vehicles(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let aside = Aside::of(map, found.number(&NARROW));
    let mut told = HashSet::default();
    for lane in aside.lanes() {
        for end in ContactPoint::BOTH {
            let Some(before) = aside.route_beside(LaneEnd::of(lane, end)) else {
                continue;
            };
            let Some((after, row)) = aside.follow(lane, end.other()) else {
                continue;
            };
            if told.contains(&lane.key()) || row.iter().any(|one| aside.has_way_around(*one)) {
                continue;
            }
            told.extend(row.iter().map(|one| one.key()));
            let kind = lane.kind().unwrap_or_default();
            let text = format!(
                "{} has type `{kind}`, on which no vehicle drives, but lies between {} and {}, which are lanes for \
                 vehicles; routes end before it; use a type such as `driving`, or remove the links",
                lane_name(lane),
                lane_name(before),
                lane_name(after)
            );
            found
                .issue(Place::attribute_or_node(lane.node(), "type"), text)
                .at_lane_end(lane, end)
                .at(before.node(), "the lane on one side")
                .at(after.node(), "the lane on the other side");
        }
    }
}

/// The lanes with types of [`ASIDE`] and the lanes linked to their ends.
struct Aside<'m, 'a> {
    map: &'m RoadMap<'a>,
    narrow: f64,
    beside: HashMap<LaneEnd, Vec<LaneEnd>>,
}

impl<'m, 'a> Aside<'m, 'a> {
    fn of(map: &'m RoadMap<'a>, narrow: f64) -> Aside<'m, 'a> {
        let mut beside: HashMap<LaneEnd, Vec<LaneEnd>> = HashMap::default();
        for joint in map.lane_joints() {
            for (here, there) in [(joint.from, joint.to), (joint.to, joint.from)] {
                if map.lane(here.lane).is_some_and(is_aside) {
                    beside.entry(here).or_default().push(there);
                }
            }
        }
        Aside {
            map,
            narrow,
            beside,
        }
    }

    /// Returns the lanes in document order.
    fn lanes(&self) -> Vec<LaneRef<'m, 'a>> {
        let mut keys: Vec<_> = self.beside.keys().map(|end| end.lane).collect();
        keys.sort_unstable();
        keys.dedup();
        keys.into_iter()
            .filter_map(|key| self.map.lane(key))
            .collect()
    }

    fn linked(&self, at: LaneEnd) -> impl Iterator<Item = (LaneRef<'m, 'a>, ContactPoint)> {
        let here = self.map.lane(at.lane);
        let is_wide = here.is_some_and(|lane| routes::is_wide(lane, at.end, self.narrow));
        let linked = self.beside.get(&at).into_iter().flatten();
        linked
            .filter(move |_| is_wide)
            .filter_map(|end| Some((self.map.lane(end.lane)?, end.end)))
    }

    /// Returns a lane for vehicles that is linked to this end.
    fn route_beside(&self, at: LaneEnd) -> Option<LaneRef<'m, 'a>> {
        let mut linked = self.linked(at);
        linked
            .find(|(lane, end)| is_route(*lane) && routes::is_wide(*lane, *end, self.narrow))
            .map(|(lane, _)| lane)
    }

    /// Follows the links from this end of a lane to a lane for vehicles. Returns that lane and the
    /// lanes on the way.
    fn follow(
        &self,
        lane: LaneRef<'m, 'a>,
        mut end: ContactPoint,
    ) -> Option<(LaneRef<'m, 'a>, Vec<LaneRef<'m, 'a>>)> {
        let mut row = vec![lane];
        while row.len() <= MOST_IN_A_ROW {
            let at = LaneEnd::of(*row.last()?, end);
            if let Some(after) = self.route_beside(at) {
                return Some((after, row));
            }
            let (next, entry) = self.linked(at).find(|(lane, _)| is_aside(*lane))?;
            row.push(next);
            end = entry.other();
        }
        None
    }

    /// Checks whether vehicles can pass beside the lane, or on a lane for both directions.
    fn has_way_around(&self, lane: LaneRef<'m, 'a>) -> bool {
        let mut both = [Side::Left, Side::Right].into_iter();
        let beside = |side| lane.at.side(side).any(is_route);
        let is_shared = |lane: LaneRef<'_, '_>| lane.kind() == Some("bidirectional");
        lane.side().is_none_or(beside) || both.any(|side| lane.at.side(side).any(is_shared))
    }
}

/// Checks whether a lane is for others, without rules of access that may say otherwise.
fn is_aside(lane: LaneRef<'_, '_>) -> bool {
    let is_listed = lane.kind().is_some_and(|kind| ASIDE.contains(&kind));
    // Vehicles use a biking lane that is only advisory.
    let is_shared = lane.kind() == Some("biking") && is_drivable(lane);
    is_listed && !is_shared && lane.elements("access").next().is_none()
}

//! Lines between waypoints along the lanes of the map.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use foldhash::{HashMap, HashMapExt as _};
use qcbus_opendrive::{ContactPoint, LaneKey, LaneRef, RoadMap, Side};

use super::Spot;
use crate::places::find_lane;
use crate::places::relative::OnRoad;
use crate::types::road_network::LaneAt;
use crate::types::ways::{ASIDE, may_run};

/// A lane that is driven along the road or against it.
type Driven = (LaneKey, bool);

/// Maximum number of lanes that one search visits.
const MOST_VISITS: usize = 20_000;

/// Cost of a lane change in metres.
const CHANGE: f64 = 60.0;

/// Distance that a lane change takes in a drawing, in metres.
const CHANGE_LENGTH: f64 = 40.0;

/// Distance of the points along a lane, in metres.
const SPACING: f64 = 4.0;

/// Maximum number of points along one lane.
const MOST_OF_LANE: f64 = 300.0;

/// The connections between the lanes of a map. They are read on the first search.
pub(super) struct Lanes<'w, 'r> {
    map: &'w RoadMap<'r>,
    next: std::cell::OnceCell<HashMap<Driven, Vec<Driven>>>,
}

impl<'w, 'r> Lanes<'w, 'r> {
    pub(super) fn new(map: &'w RoadMap<'r>) -> Lanes<'w, 'r> {
        Lanes {
            map,
            next: std::cell::OnceCell::new(),
        }
    }

    fn next(&self) -> &HashMap<Driven, Vec<Driven>> {
        self.next.get_or_init(|| {
            let mut next: HashMap<Driven, Vec<Driven>> = HashMap::new();
            let mut add = |leaves: (LaneKey, ContactPoint), enters: (LaneKey, ContactPoint)| {
                let from = (leaves.0, leaves.1 == ContactPoint::End);
                let to = (enters.0, enters.1 == ContactPoint::Start);
                next.entry(from).or_default().push(to);
            };
            for joint in self.map.lane_joints() {
                let (from, to) = (joint.from, joint.to);
                add((from.lane, from.end), (to.lane, to.end));
                add((to.lane, to.end), (from.lane, from.end));
            }
            next
        })
    }

    /// Returns the points of the shortest way from one place to another, without its ends. Returns
    /// `None` if none is found.
    pub(super) fn between(&self, from: OnRoad<'w, 'r>, to: OnRoad<'w, 'r>) -> Option<Vec<Spot>> {
        let (start, goal) = (lane_of(from)?, lane_of(to)?);
        let way = self.way((start, from.s), (goal, to.s))?;
        let mut points = Vec::new();
        let mut at = Some(from.s);
        for (number, (key, along)) in way.iter().enumerate() {
            let lane = self.map.lane(*key)?;
            let (enters, leaves) = ends(lane, *along)?;
            let begin = at.take().unwrap_or(enters);
            let following = way.get(number + 1);
            // The next lane of the same section is reached by a lane change.
            let changes = following.is_some_and(|(next, _)| is_beside(*key, *next));
            if changes {
                let rest = way.get(number..).unwrap_or_default();
                let is_last = rest.iter().all(|(next, _)| is_section(*key, *next));
                let until = if is_last { to.s } else { leaves };
                let by = CHANGE_LENGTH.min((until - begin).abs() / 2.0);
                at = Some(if *along { begin + by } else { begin - by });
                continue;
            }
            let end = if following.is_none() { to.s } else { leaves };
            sample(lane, begin, end, &mut points);
        }
        Some(points)
    }

    /// Searches for the shortest way by lanes.
    fn way(&self, from: (LaneRef<'w, 'r>, f64), to: (LaneRef<'w, 'r>, f64)) -> Option<Vec<Driven>> {
        let goal = to.0.key();
        let mut best: HashMap<Driven, (f64, Option<Driven>)> = HashMap::new();
        let mut open = BinaryHeap::new();
        for along in [true, false] {
            if may_run(from.0, along) {
                best.insert((from.0.key(), along), (0.0, None));
                open.push(Reverse((Cost(0.0), (from.0.key(), along))));
            }
        }
        let mut visits = 0;
        while let Some(Reverse((Cost(cost), here))) = open.pop() {
            let known = best.get(&here)?;
            if cost > known.0 {
                continue;
            }
            let is_first = known.1.is_none();
            let is_behind = is_first && is_section(here.0, goal) && !is_ahead(from.1, to.1, here.1);
            if here.0 == goal && !is_behind {
                return Some(traced(&best, here));
            }
            visits += 1;
            if visits > MOST_VISITS {
                return None;
            }
            for (next, more) in self.onward(here) {
                let leads_back = is_behind && is_section(next.0, here.0);
                let sum = cost + more;
                let is_better = best.get(&next).is_none_or(|(other, _)| sum < *other);
                if is_better && !leads_back {
                    best.insert(next, (sum, Some(here)));
                    open.push(Reverse((Cost(sum), next)));
                }
            }
        }
        None
    }

    /// Returns the lanes after a lane and beside it, with the cost of each step.
    fn onward(&self, (key, along): Driven) -> Vec<(Driven, f64)> {
        let Some(lane) = self.map.lane(key) else {
            return Vec::new();
        };
        let length = lane.length().unwrap_or(0.0).max(0.0);
        let is_used = |lane: LaneRef<'_, '_>| lane.kind().is_none_or(|it| !ASIDE.contains(&it));
        let joined = self.next().get(&(key, along)).into_iter().flatten();
        let joined = joined.filter(|(next, onward)| {
            let next = self.map.lane(*next);
            next.is_some_and(|next| is_used(next) && may_run(next, *onward))
        });
        let mut steps: Vec<(Driven, f64)> = joined.map(|next| (*next, length)).collect();
        let side = lane.side().unwrap_or(Side::Right);
        let beside = lane.at.side(side).filter(|other| {
            let gap = other
                .id()
                .zip(lane.id())
                .map(|(one, other)| one.abs_diff(other));
            gap == Some(1) && is_used(*other) && may_run(*other, along)
        });
        steps.extend(beside.map(|other| ((other.key(), along), CHANGE)));
        steps
    }
}

fn lane_of<'w, 'r>(on: OnRoad<'w, 'r>) -> Option<LaneRef<'w, 'r>> {
    match find_lane(on.road, on.s, on.lane?) {
        LaneAt::Lane(lane) => Some(lane),
        LaneAt::None(_) | LaneAt::Unknown => None,
    }
}

/// Returns the stations at which a lane is entered and left.
fn ends(lane: LaneRef<'_, '_>, along: bool) -> Option<(f64, f64)> {
    let start = lane.at.s()?;
    let end = start + lane.length()?;
    Some(if along { (start, end) } else { (end, start) })
}

fn is_section(one: LaneKey, other: LaneKey) -> bool {
    (one.road, one.layer, one.section) == (other.road, other.layer, other.section)
}

fn is_beside(one: LaneKey, other: LaneKey) -> bool {
    is_section(one, other) && one.lane != other.lane
}

fn is_ahead(from: f64, to: f64, along: bool) -> bool {
    if along { to >= from } else { to <= from }
}

fn traced(best: &HashMap<Driven, (f64, Option<Driven>)>, goal: Driven) -> Vec<Driven> {
    let before = |here: &Driven| best.get(here).and_then(|(_, before)| *before);
    let back = std::iter::successors(Some(goal), before);
    // A circle is impossible, because the cost grows. The limit guards against costs that are lost
    // in rounding.
    let mut way: Vec<Driven> = back.take(MOST_VISITS).collect();
    way.reverse();
    way
}

/// Adds points along the middle of a lane.
fn sample(lane: LaneRef<'_, '_>, from: f64, to: f64, points: &mut Vec<Spot>) {
    let Some(start) = lane.at.s() else { return };
    let steps = ((to - from).abs() / SPACING)
        .ceil()
        .clamp(1.0, MOST_OF_LANE);
    for step in 0..=steps as usize {
        let s = from + (to - from) * step as f64 / steps;
        let ds = (s - start).max(0.0);
        let t = lane.inner_t(ds).zip(lane.outer_t(ds));
        let pose = lane.at.road.pose(s);
        let point = t
            .zip(pose)
            .and_then(|((inner, outer), pose)| pose.beside(f64::midpoint(inner, outer)));
        points.extend(point.map(|point| [point.x, point.y]));
    }
}

/// A cost in metres, which is never NaN.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cost(f64);

impl Eq for Cost {}

impl PartialOrd for Cost {
    fn partial_cmp(&self, other: &Cost) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cost {
    fn cmp(&self, other: &Cost) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

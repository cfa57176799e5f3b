//! Reachability of one place of a map from another for traffic.

use foldhash::{HashMap, HashMapExt as _, HashSet, HashSetExt as _};
use qcbus_opendrive::{ContactPoint, LaneRef, Road, RoadMap, Side, Traffic};

/// A lane section of a road, and whether it is passed along or against the road.
type Stretch = (usize, usize, bool);

/// Connections from each stretch of road.
#[derive(Debug)]
pub struct Ways {
    /// Connections in the direction of traffic.
    driven: HashMap<Stretch, Vec<Stretch>>,
    /// Connections in any direction.
    linked: HashMap<Stretch, Vec<Stretch>>,
}

/// Position of a waypoint: the stretches that it may be on, and the station.
#[derive(Debug, Clone)]
pub struct Stop {
    stretches: Vec<Stretch>,
    s: f64,
}

impl Stop {
    /// Returns the stop in a lane, in every direction in which traffic may run there.
    pub fn in_lane(lane: LaneRef<'_, '_>, s: f64) -> Stop {
        let along = [true, false];
        let along = along.into_iter().filter(|along| may_run(lane, *along));
        Stop {
            stretches: along.map(|along| stretch(lane, along)).collect(),
            s,
        }
    }

    /// Returns the stop on a road, on both sides and in both directions. Returns `None` if the road
    /// has no lanes there.
    pub fn on_road(road: &Road<'_>, s: f64) -> Option<Stop> {
        let layer = road.permanent()?;
        let sections = Side::BOTH
            .iter()
            .filter_map(|side| Some(layer.section_at(road, *side, s)?.index()));
        let mut stretches: Vec<_> = sections
            .flat_map(|section| [true, false].map(|along| (road.index(), section, along)))
            .collect();
        stretches.dedup();
        (!stretches.is_empty()).then_some(Stop { stretches, s })
    }
}

/// Connection from one waypoint to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// In the direction of traffic.
    Driven,
    /// Against the direction of traffic only.
    Against,
    /// No connection.
    None,
    /// Unknown, because the search exceeds its budget.
    Unknown,
}

impl Ways {
    /// Builds the connections of a map. Returns `None` if links are of a kind that does not join
    /// lanes.
    pub fn of(map: &RoadMap<'_>) -> Option<Ways> {
        let is_simple = map
            .junctions()
            .iter()
            .all(|junction| junction.node().attr("type") != Some("virtual"));
        let is_linked = map.roads().iter().all(|road| {
            let link = road.link_node();
            link.into_iter()
                .flat_map(|link| link.children())
                .all(|link| link.attr("elementS").is_none())
        });
        if !is_simple || !is_linked {
            return None;
        }
        let mut ways = Ways {
            driven: HashMap::new(),
            linked: HashMap::new(),
        };
        for joint in map.lane_joints() {
            let lanes = (map.lane(joint.from.lane), map.lane(joint.to.lane));
            let (Some(from), Some(to)) = lanes else {
                continue;
            };
            ways.add((from, joint.from.end), (to, joint.to.end));
            ways.add((to, joint.to.end), (from, joint.from.end));
        }
        Some(ways)
    }

    /// Adds a connection from one end of a lane to an end of another lane.
    fn add(
        &mut self,
        (from, leaves): (LaneRef<'_, '_>, ContactPoint),
        (to, enters): (LaneRef<'_, '_>, ContactPoint),
    ) {
        let along = leaves == ContactPoint::End;
        let onward = enters == ContactPoint::Start;
        let (here, there) = (stretch(from, along), stretch(to, onward));
        self.linked.entry(here).or_default().push(there);
        let is_driven =
            |lane: LaneRef<'_, '_>| lane.kind().is_none_or(|kind| !ASIDE.contains(&kind));
        if is_driven(from) && is_driven(to) && may_run(from, along) && may_run(to, onward) {
            self.driven.entry(here).or_default().push(there);
        }
    }

    /// Returns the connection from one stop to another. `budget` is the number of stretches that
    /// may still be visited, because the number of routes in a scenario is unlimited.
    pub fn between(&self, from: &Stop, to: &Stop, budget: &mut usize) -> Way {
        if is_ahead(from, to) || reaches(&self.driven, from, to, budget) {
            return Way::Driven;
        }
        let turned = |stop: &Stop| Stop {
            stretches: stop
                .stretches
                .iter()
                .flat_map(|(road, section, _)| [true, false].map(|along| (*road, *section, along)))
                .collect(),
            s: stop.s,
        };
        let (from, to) = (turned(from), turned(to));
        let is_linked = is_ahead(&from, &to) || reaches(&self.linked, &from, &to, budget);
        match (*budget, is_linked) {
            (0, _) => Way::Unknown,
            (_, true) => Way::Against,
            (_, false) => Way::None,
        }
    }
}

fn stretch(lane: LaneRef<'_, '_>, along: bool) -> Stretch {
    (lane.at.road.index(), lane.at.index(), along)
}

/// Checks whether the second stop is farther on in the same stretch.
fn is_ahead(from: &Stop, to: &Stop) -> bool {
    from.stretches.iter().any(|(road, section, along)| {
        to.stretches.iter().any(|(other, later, onward)| {
            road == other
                && section == later
                && along == onward
                && if *along {
                    from.s <= to.s
                } else {
                    from.s >= to.s
                }
        })
    })
}

fn reaches(
    ways: &HashMap<Stretch, Vec<Stretch>>,
    from: &Stop,
    to: &Stop,
    budget: &mut usize,
) -> bool {
    let goals: HashSet<Stretch> = to.stretches.iter().copied().collect();
    let mut seen: HashSet<Stretch> = HashSet::new();
    let mut open: Vec<Stretch> = from.stretches.clone();
    while let Some(here) = open.pop() {
        for next in ways.get(&here).into_iter().flatten() {
            if *budget == 0 {
                return false;
            }
            *budget -= 1;
            if goals.contains(next) {
                return true;
            }
            if seen.insert(*next) {
                open.push(*next);
            }
        }
    }
    false
}

/// Lane types that no route uses.
pub(crate) const ASIDE: &[&str] = &[
    "biking", "border", "curb", "median", "none", "parking", "rail", "shoulder", "sidewalk",
    "tram", "walking",
];

/// Checks whether traffic may run on a lane along the road or against it. If this is unknown, the
/// answer is yes.
pub(crate) fn may_run(lane: LaneRef<'_, '_>, along: bool) -> bool {
    let towards = if along {
        ContactPoint::End
    } else {
        ContactPoint::Start
    };
    Traffic::of(lane).may_run_towards(towards)
}

//! Lanes of a direct junction that share their space, because they begin or end in the same lane
//! (OpenDRIVE 1.9, 12.6).

use std::collections::BTreeMap;

use super::strips::{Patch, area, common, strip};
use crate::prelude::*;

/// Default of `overlapZone`, in metres.
pub(crate) const DEFAULT_ZONE: f64 = 100.0;

/// Distance to follow lanes beyond the overlap zone, in metres; the step follows.
const BEYOND: f64 = 100.0;
const STEP: f64 = 1.0;
const SHRINK: f64 = 0.05;

/// Maximum distance of two pieces along their lanes. Pieces farther apart do not meet.
const WINDOW: usize = 12;

/// Maximum number of lanes that begin in one lane.
const MOST: usize = 4;

/// A lane that shares its space with another lane of the junction.
pub(crate) struct Arm<'m, 'a> {
    /// The `<laneLink>` that leads to the lane.
    pub link: Node<'a>,
    pub lane: LaneRef<'m, 'a>,
    /// The end of its road at the junction.
    pub end: ContactPoint,
    course: Vec<Course<'m, 'a>>,
}

/// Two lanes that share their space.
pub(crate) struct SharedSpace<'m, 'a> {
    pub arms: [Arm<'m, 'a>; 2],
    /// Length of the shared space along each lane, in metres from the junction.
    pub lengths: [f64; 2],
    /// Places that both lanes cover, as s and t on each road.
    pub places: Vec<[(f64, f64); 2]>,
}

/// The part of a lane within one lane section, with its pieces.
struct Course<'m, 'a> {
    lane: LaneRef<'m, 'a>,
    patches: Vec<Patch>,
}

/// Returns all pairs of lanes that share their space at direct junctions.
pub(crate) fn shared_spaces<'m, 'a>(map: &'m RoadMap<'a>) -> Vec<SharedSpace<'m, 'a>> {
    let direct = |joint: &&LaneJoint<'_>| {
        let junction = joint.junction.and_then(|at| map.junctions().get(at));
        junction.is_some_and(|one| one.kind() == Some(JunctionType::Direct))
    };
    // Key: the lane end in which the lanes begin or end. Value: these lanes with their links.
    let mut groups: BTreeMap<LaneEnd, Vec<(LaneEnd, Node<'a>)>> = BTreeMap::new();
    for joint in map.junction_joints().iter().filter(direct) {
        for (one, other) in [(joint.from, joint.to), (joint.to, joint.from)] {
            let group = groups.entry(one).or_default();
            let known = group
                .iter()
                .any(|(end, _)| end.lane.road == other.lane.road);
            if !known && group.len() < MOST {
                group.push((other, joint.node));
            }
        }
    }
    let mut all = Vec::new();
    for group in groups.values() {
        for (at, one) in group.iter().enumerate() {
            for other in &group[at + 1..] {
                let arms = [arm(map, *one), arm(map, *other)];
                if let [Some(one), Some(other)] = arms {
                    all.extend(shared_space([one, other]));
                }
            }
        }
    }
    all
}

/// Returns the overlap zone of a lane link.
pub(crate) fn zone(link: Node<'_>) -> Option<f64> {
    link.f64("overlapZone").ok().filter(|zone| zone.is_finite())
}

fn arm<'m, 'a>(map: &'m RoadMap<'a>, (end, link): (LaneEnd, Node<'a>)) -> Option<Arm<'m, 'a>> {
    let lane = map.lane(end.lane)?;
    let reach = zone(link).unwrap_or(DEFAULT_ZONE) + BEYOND;
    Some(Arm {
        link,
        lane,
        end: end.end,
        course: course(lane, end.end, reach),
    })
}

/// Follows a lane away from the junction while exactly one lane continues it.
fn course<'m, 'a>(lane: LaneRef<'m, 'a>, end: ContactPoint, reach: f64) -> Vec<Course<'m, 'a>> {
    let mut all = Vec::new();
    let (mut next, mut left) = (Some(lane), reach);
    while let Some(lane) = next.take() {
        let Some(length) = lane.length().filter(|length| *length > 0.0) else {
            break;
        };
        let Some(start) = lane.at.s() else { break };
        let here = length.min(left);
        let range = match end {
            ContactPoint::Start => [start, start + here],
            ContactPoint::End => [start + length, start + length - here],
        };
        let patches = strip(lane.at.road, range, STEP, SHRINK, |station| {
            let ds = station.shifted(-start);
            let (one, other) = (lane.t(Edge::Inner, ds)?, lane.t(Edge::Outer, ds)?);
            Some((one.min(other), one.max(other)))
        });
        all.push(Course { lane, patches });
        left -= here;
        if left > 0.0 && all.len() < 64 {
            next = goes_on(lane, end.other());
        }
    }
    all
}

fn goes_on<'m, 'a>(lane: LaneRef<'m, 'a>, end: ContactPoint) -> Option<LaneRef<'m, 'a>> {
    let mut links = lane.links(end);
    let only = links.next().filter(|_| links.next().is_none())?;
    let section = lane.at.neighbour(lane.side().unwrap_or(Side::Right), end)?;
    section.lane(only.id()?)
}

fn shared_space<'m, 'a>(arms: [Arm<'m, 'a>; 2]) -> Option<SharedSpace<'m, 'a>> {
    let pieces = |arm: &Arm<'_, '_>| -> Vec<Patch> {
        let all = arm.course.iter().flat_map(|course| course.patches.iter());
        all.cloned().collect()
    };
    let [ones, others] = [pieces(&arms[0]), pieces(&arms[1])];
    let starts = [start_of(&arms[0])?, start_of(&arms[1])?];
    let mut lengths = [0.0_f64; 2];
    let mut places = Vec::new();
    for (at, one) in ones.iter().enumerate() {
        let near = others
            .iter()
            .take(at + WINDOW + 1)
            .skip(at.saturating_sub(WINDOW));
        let mut any = false;
        for other in near {
            let Some(shape) = common(&one.corners, &other.corners).filter(|it| area(it) > 1e-4)
            else {
                continue;
            };
            any = true;
            for point in &shape {
                let here = [one.road_coordinates(*point), other.road_coordinates(*point)];
                for at in 0..2 {
                    lengths[at] = lengths[at].max((here[at].0 - starts[at]).abs());
                }
            }
            places.extend(place(one, other, &shape));
        }
        // Lanes that meet again farther on do not concern this junction.
        if !any && at > 1 {
            break;
        }
    }
    (!places.is_empty()).then_some(SharedSpace {
        arms,
        lengths,
        places,
    })
}

fn place(one: &Patch, other: &Patch, shape: &[Point]) -> Option<[(f64, f64); 2]> {
    let middle = super::strips::middle(shape)?;
    Some([one.road_coordinates(middle), other.road_coordinates(middle)])
}

fn start_of(arm: &Arm<'_, '_>) -> Option<f64> {
    arm.lane.at.road.end_s(arm.end)
}

impl<'m, 'a> Arm<'m, 'a> {
    pub fn road(&self) -> &'m Road<'a> {
        self.lane.at.road
    }

    /// Returns the height of the lane's surface at (s, t) of its road.
    pub fn height(&self, (s, t): (f64, f64)) -> Option<f64> {
        let holds = |course: &&Course<'_, '_>| {
            let range = course.lane.at.s().zip(course.lane.length());
            range.is_some_and(|(start, length)| s >= start && s <= start + length)
        };
        let lane = self.course.iter().find(holds)?.lane;
        let ds = Station::at(s - lane.at.s()?);
        let (inner, outer) = (lane.inner_t(ds)?, lane.outer_t(ds)?);
        let share = if outer == inner {
            0.0
        } else {
            (t - inner) / (outer - inner)
        };
        Some(lane.surface_point(ds, share.clamp(0.0, 1.0))?.z)
    }
}

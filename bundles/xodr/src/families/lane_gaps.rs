//! Checks whether linked lanes touch (OpenDRIVE 1.9, annex D.1.2).
//!
//! A lane may be linked to several adjacent lanes, and several to one. Therefore groups of lanes
//! are compared: all lanes that the links of one boundary connect. The left edge on one side must
//! end where the left edge on the other side begins; the same holds for the right edge. Edges are
//! identified by t, even for a lane that changes its side of the center. A link between lanes
//! without common width is wrong and forms no group.

use super::driving::is_drivable;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_opendrive::geometry::Point3;

/// Two linked drivable lanes whose edges do not meet.
pub(crate) struct LaneGap<'m, 'a> {
    pub from: LaneRef<'m, 'a>,
    pub to: LaneRef<'m, 'a>,
    /// One of the links that connect the groups.
    pub joint: LaneJoint<'a>,
    /// Distance between the groups as a whole, in metres. It is small if only a corner is missing.
    pub whole: f64,
    /// Distances in metres at the edges that do not meet, each with the point in between.
    pub edges: Vec<(f64, Point3)>,
}

/// Returns the gaps between linked drivable lanes that are wider than `limit`, in metres in the
/// plan view. Lanes whose width at the contact is at most `zero` are ignored.
pub(crate) fn lane_gaps<'m, 'a>(
    map: &'m RoadMap<'a>,
    limit: f64,
    zero: f64,
) -> Vec<LaneGap<'m, 'a>> {
    let (mut touches, mut boundaries) = (Vec::new(), Vec::new());
    let mut astray = HashSet::default();
    let mut gaps = Vec::new();
    for joint in map.lane_joints() {
        let Some(touch) = Touch::of(map, joint, zero) else {
            continue;
        };
        let [low, high] = touch.in_order();
        if touch.overlaps(limit) {
            boundaries.push(((section(low), section(high)), touches.len()));
            touches.push(touch);
        } else if astray.insert((low, high)) {
            gaps.extend(gaps_of(&[touch], limit, false));
        }
    }
    boundaries.sort_unstable();
    for boundary in boundaries.chunk_by(|(one, _), (next, _)| one == next) {
        let touches = boundary.iter().filter_map(|(_, at)| touches.get(*at));
        let groups = hanging_together(touches.copied()).into_iter();
        gaps.extend(groups.flat_map(|group| gaps_of(&group, limit, true)));
    }
    gaps
}

/// A lane where it meets another one: t and point of its edges, smaller t first.
#[derive(Clone, Copy)]
struct Side<'m, 'a> {
    lane: LaneRef<'m, 'a>,
    edges: [(f64, Point3); 2],
}

impl<'m, 'a> Side<'m, 'a> {
    fn of(map: &'m RoadMap<'a>, at: LaneEnd, zero: f64) -> Option<Side<'m, 'a>> {
        let lane = map.lane(at.lane)?;
        let [inner, outer] = Edge::BOTH.map(|edge| lane.border_at(edge, at.end));
        let mut edges = [inner?, outer?].map(|border| (border.t, border.point));
        edges.sort_by(|one, other| one.0.total_cmp(&other.0));
        (edges[1].0 - edges[0].0 > zero).then_some(Side { lane, edges })
    }
}

/// A link between two lanes with the actual positions of the lanes.
#[derive(Clone, Copy)]
struct Touch<'m, 'a> {
    joint: &'m LaneJoint<'a>,
    from: Side<'m, 'a>,
    to: Side<'m, 'a>,
}

impl<'m, 'a> Touch<'m, 'a> {
    fn of(map: &'m RoadMap<'a>, joint: &'m LaneJoint<'a>, zero: f64) -> Option<Touch<'m, 'a>> {
        Some(Touch {
            joint,
            from: Side::of(map, joint.from, zero)?,
            to: Side::of(map, joint.to, zero)?,
        })
    }

    fn lane_ends(&self) -> [LaneEnd; 2] {
        [self.joint.from, self.joint.to]
    }

    /// Returns the two ends in an order that is independent of the direction of the link.
    fn in_order(&self) -> [LaneEnd; 2] {
        let mut ends = self.lane_ends();
        ends.sort();
        ends
    }

    /// Checks whether the lanes have some width in common, measured across the first one.
    fn overlaps(&self, limit: f64) -> bool {
        let [(_, right), (_, left)] = self.from.edges;
        let width = right.plan().distance(left.plan());
        let across = |point: Point3| {
            ((point.x - right.x) * (left.x - right.x) + (point.y - right.y) * (left.y - right.y))
                / width
        };
        let [one, other] = self.to.edges.map(|(_, point)| across(point));
        let common = width.min(one.max(other)) - one.min(other).max(0.0);
        let narrower = width.min((one - other).abs());
        common > limit.min(0.5 * narrower)
    }
}

fn section(at: LaneEnd) -> (u32, u32, u32, ContactPoint) {
    (at.lane.road, at.lane.layer, at.lane.section, at.end)
}

/// Splits the joints of a boundary into groups without common lanes.
fn hanging_together<'m, 'a: 'm>(
    touches: impl Iterator<Item = Touch<'m, 'a>>,
) -> Vec<Vec<Touch<'m, 'a>>> {
    // Group of each lane end. A merge renames the smaller group to keep the cost low.
    let mut group_of: HashMap<LaneEnd, usize> = HashMap::default();
    let mut groups: Vec<Vec<Touch<'m, 'a>>> = Vec::new();
    for touch in touches {
        let joint = touch.joint;
        let known = [joint.from, joint.to].map(|end| group_of.get(&end).copied());
        let group = match known {
            [None, None] => {
                groups.push(Vec::new());
                groups.len() - 1
            }
            [Some(one), None] | [None, Some(one)] => one,
            [Some(one), Some(other)] if one == other => one,
            [Some(one), Some(other)] => {
                let (keep, merge) = if groups[one].len() >= groups[other].len() {
                    (one, other)
                } else {
                    (other, one)
                };
                let moved = std::mem::take(&mut groups[merge]);
                for end in moved.iter().flat_map(Touch::lane_ends) {
                    group_of.insert(end, keep);
                }
                groups[keep].extend(moved);
                keep
            }
        };
        group_of.insert(joint.from, group);
        group_of.insert(joint.to, group);
        groups[group].push(touch);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// An edge of a group: its lane, its t and its point.
type GroupEdge<'m, 'a> = (LaneRef<'m, 'a>, f64, Point3);

/// Returns the edges with the smallest and the largest t on one side of a group.
fn edges<'m, 'a>(sides: impl Iterator<Item = Side<'m, 'a>>) -> Option<[GroupEdge<'m, 'a>; 2]> {
    let all = sides.flat_map(|side| side.edges.map(|(t, point)| (side.lane, t, point)));
    let mut extremes: Option<[GroupEdge<'m, 'a>; 2]> = None;
    for edge in all {
        let [least, most] = extremes.get_or_insert([edge, edge]);
        if edge.1 < least.1 {
            *least = edge;
        }
        if edge.1 > most.1 {
            *most = edge;
        }
    }
    extremes
}

fn gaps_of<'m, 'a>(group: &[Touch<'m, 'a>], limit: f64, overlap: bool) -> Vec<LaneGap<'m, 'a>> {
    let Some(first) = group.iter().min_by_key(|touch| touch.joint.node) else {
        return Vec::new();
    };
    let joint = first.joint;
    let home = section(joint.from);
    let on_side = |here: bool| {
        let sides = group
            .iter()
            .flat_map(|touch| [(touch.joint.from, touch.from), (touch.joint.to, touch.to)]);
        sides
            .filter(move |(end, _)| (section(*end) == home) == here)
            .map(|(_, side)| side)
    };
    let (Some(here), Some([least, most])) = (edges(on_side(true)), edges(on_side(false))) else {
        return Vec::new();
    };
    let there = if joint.is_reversed() {
        [most, least]
    } else {
        [least, most]
    };
    let whole = apart(&here, &there, overlap);
    let mut gaps: Vec<LaneGap<'m, 'a>> = Vec::new();
    for ((from, _, start), (to, _, end)) in here.into_iter().zip(there) {
        let distance = start.plan().distance(end.plan());
        if distance <= limit || !is_drivable(from) || !is_drivable(to) {
            continue;
        }
        let edge = (distance, middle(start, end));
        let same =
            |gap: &&mut LaneGap<'m, 'a>| gap.from.key() == from.key() && gap.to.key() == to.key();
        match gaps.iter_mut().find(same) {
            Some(gap) => gap.edges.push(edge),
            None => gaps.push(LaneGap {
                from,
                to,
                joint: *joint,
                whole,
                edges: vec![edge],
            }),
        }
    }
    gaps
}

/// Returns the distance between two groups: of their middles or, if they overlap, of an edge if
/// that is less. If only the widths differ, an edge or the middle may be right.
fn apart(here: &[GroupEdge<'_, '_>; 2], there: &[GroupEdge<'_, '_>; 2], overlap: bool) -> f64 {
    let [(.., a), (.., b)] = here;
    let [(.., c), (.., d)] = there;
    let between = |one: Point3, other: Point3| one.plan().distance(other.plan());
    let middles = between(middle(*a, *b), middle(*c, *d));
    if overlap {
        middles.min(between(*a, *c)).min(between(*b, *d))
    } else {
        middles
    }
}

fn middle(one: Point3, other: Point3) -> Point3 {
    Point3 {
        x: 0.5 * (one.x + other.x),
        y: 0.5 * (one.y + other.y),
        z: 0.5 * (one.z + other.z),
    }
}

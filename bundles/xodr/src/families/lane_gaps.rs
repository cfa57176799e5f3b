//! Whether linked lanes touch (OpenDRIVE 1.9, annex D.1.2).
//!
//! A lane may be linked to several that lie side by side, and several to one. So not lanes are
//! compared, but groups of lanes that the links of one boundary hang together: where the left edge of
//! the group on one side ends, that of the group on the other side must begin, and likewise the right
//! edge. Edges are told apart by t, which also does for a lane that changes its side of the center. A
//! link between lanes that have no width in common is wrong by itself and forms no group.

use foldhash::{HashMap, HashSet};
use qcbus_opendrive::geometry::Point3;
use qcbus_opendrive::{ContactPoint, Edge, LaneEnd, LaneJoint, LaneRef, RoadMap};

use super::driving::is_drivable;

/// Two drivable lanes that are linked and whose edges miss each other.
pub(crate) struct LaneGap<'m, 'a> {
    pub from: LaneRef<'m, 'a>,
    pub to: LaneRef<'m, 'a>,
    /// One statement that links the groups.
    pub joint: LaneJoint<'a>,
    /// How far apart they lie as a whole, in metres: no more than a corner may be missing elsewhere.
    pub whole: f64,
    /// The distances in metres at the edges that miss each other, and the point in between.
    pub edges: Vec<(f64, Point3)>,
}

/// The gaps between linked drivable lanes that are wider than `limit`, in metres in the plan view.
/// Lanes that are not wider than `zero` where they meet do not take part.
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

/// A lane at the place where it meets another: t and place of its edges, the one with the lesser t
/// first.
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

/// A statement that two lanes touch, with where they really are.
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

    /// The two ends in an order that does not depend on which of them states it.
    fn in_order(&self) -> [LaneEnd; 2] {
        let mut ends = self.lane_ends();
        ends.sort();
        ends
    }

    /// Whether the lanes have some width in common, looking along the first one.
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

/// Splits the joints of a boundary into groups that have no lane in common.
fn hanging_together<'m, 'a: 'm>(
    touches: impl Iterator<Item = Touch<'m, 'a>>,
) -> Vec<Vec<Touch<'m, 'a>>> {
    // Group of each lane end; merging renames the smaller number, so that chains stay short.
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

/// An edge of a group: the lane that has it, its t and its place.
type GroupEdge<'m, 'a> = (LaneRef<'m, 'a>, f64, Point3);

/// The edges of one side of a group with the least and the greatest t.
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

/// How far two groups lie apart as a whole: their middles, and where they have some width in common also
/// either edge. Where one is only wider than the other, an edge or the middle may be where it should.
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

//! Boundary of a junction as a closed ring of points, and reference line of a junction (OpenDRIVE
//! 1.9, 12.9 to 12.11).

use crate::prelude::*;
use qcbus_opendrive::SegmentStation;

/// Distance between samples along a border, in metres.
const SPACING: f64 = 1.0;

/// Maximum number of samples along one segment.
const MOST_SAMPLES: f64 = 64.0;

/// A segment of a boundary with the points along it.
pub(crate) struct Stretch<'a> {
    pub segment: BoundarySegment<'a>,
    pub points: Vec<Point>,
}

impl Stretch<'_> {
    pub fn first(&self) -> Option<Point> {
        self.points.first().copied()
    }

    pub fn last(&self) -> Option<Point> {
        self.points.last().copied()
    }
}

/// Returns the boundary of a junction, or `None` without one or if a segment is invalid.
pub(crate) fn boundary<'a>(map: &RoadMap<'a>, junction: &Junction<'a>) -> Option<Vec<Stretch<'a>>> {
    let segments = junction.boundary()?.segments();
    let mut stretches = segments
        .map(|segment| {
            let points = points(map, segment)?;
            Some(Stretch { segment, points })
        })
        .collect::<Option<Vec<_>>>()?;
    turn_joints(&mut stretches);
    (!stretches.is_empty()).then_some(stretches)
}

/// Returns the points of a boundary in order. Straight lines bridge gaps.
pub(crate) fn ring(stretches: &[Stretch<'_>]) -> Vec<Point> {
    stretches
        .iter()
        .flat_map(|one| one.points.iter().copied())
        .collect()
}

/// Returns twice the signed area of a ring, positive if it runs counter-clockwise.
pub(crate) fn doubled_area(ring: &[Point]) -> f64 {
    // Coordinates relative to the first point lose no digits far from the origin.
    let Some(base) = ring.first() else { return 0.0 };
    super::polygons::sides(ring)
        .map(|(a, b)| (a.x - base.x) * (b.y - base.y) - (b.x - base.x) * (a.y - base.y))
        .sum()
}

fn points(map: &RoadMap<'_>, segment: BoundarySegment<'_>) -> Option<Vec<Point>> {
    let road = map.road(segment.road_id()?)?;
    match segment.kind()? {
        "lane" => along_lane(road, segment),
        "joint" => across(road, segment),
        _ => None,
    }
}

fn along_lane(road: &Road<'_>, segment: BoundarySegment<'_>) -> Option<Vec<Point>> {
    let station = |station: SegmentStation| match station {
        SegmentStation::S(s) => Some(s),
        SegmentStation::End(end) => road.end_s(end),
    };
    let (from, to) = (station(segment.s_start()?)?, station(segment.s_end()?)?);
    let id = segment.boundary_lane()?;
    let length = to - from;
    let count = (length.abs() / SPACING).ceil().clamp(1.0, MOST_SAMPLES) as usize;
    let at = |step: usize| from + length * step as f64 / count as f64;
    (0..=count)
        .map(|step| outer_border(road, id, at(step)))
        .collect()
}

/// Returns a point on the outer border of a lane, or on the line of the center lane.
fn outer_border(road: &Road<'_>, id: i64, s: f64) -> Option<Point> {
    let side = Side::of_lane_id(id).unwrap_or(Side::Right);
    let end = road.length()?;
    let station = if s >= end {
        Station::before(end)
    } else {
        Station::at(s)
    };
    let layer = road.permanent()?;
    if id == 0 {
        return road
            .pose(station)?
            .beside(layer.offset().at_or_zero(station)?);
    }
    let section = layer.section_at(road, side, station)?;
    let lane = section.lane(id)?;
    let ds = station.shifted(-section.s()?);
    Some(lane.border(Edge::Outer, ds)?.point.plan())
}

/// Returns the straight line across the end of a road, over all lanes from the first to the second
/// one. Without given lanes it runs from edge to edge.
fn across(road: &Road<'_>, segment: BoundarySegment<'_>) -> Option<Vec<Point>> {
    let end = segment.contact_point()?;
    let s = road.end_s(end)?;
    let last = |side: Side| {
        let section = road.permanent()?.end_section(road, side, end)?;
        let lane = section.side(side).next_back();
        Some(lane.map_or(0, |lane| lane.id().unwrap_or(0)))
    };
    let from = segment.joint_lane_start().or_else(|| last(Side::Right))?;
    let to = segment.joint_lane_end().or_else(|| last(Side::Left))?;
    // If both lanes are on one side, the line starts at the inner border of the nearer lane. That
    // is the outer border of its inner neighbour.
    let same_side = from != 0 && from.signum() == to.signum();
    let nearer = |id: i64, other: i64| {
        if same_side && id.unsigned_abs() <= other.unsigned_abs() {
            id - id.signum()
        } else {
            id
        }
    };
    let stop = if from == to { to } else { nearer(to, from) };
    Some(vec![
        outer_border(road, nearer(from, to), s)?,
        outer_border(road, stop, s)?,
    ])
}

/// Sets the direction of joints without lanes or with a single one from their neighbours.
fn turn_joints(stretches: &mut [Stretch<'_>]) {
    for at in 0..stretches.len() {
        let segment = stretches[at].segment;
        let is_joint = segment.kind() == Some("joint");
        if !is_joint || segment.joint_lane_start() != segment.joint_lane_end() {
            continue;
        }
        let before = at.checked_sub(1).unwrap_or(stretches.len() - 1);
        let (Some(come), Some(first), Some(last)) = (
            stretches[before].last(),
            stretches[at].first(),
            stretches[at].last(),
        ) else {
            continue;
        };
        if come.distance(last) < come.distance(first) {
            stretches[at].points.reverse();
        }
    }
}

/// Returns the reference line of a junction if it is a single line.
pub(crate) fn reference_line(junction: &Junction<'_>) -> Option<Placed> {
    match junction.plan_view().geometries() {
        [only] if only.kind() == Some(ShapeKind::Line) => only.placed(),
        _ => None,
    }
}

/// Returns the element of the reference line of a junction, or of the junction without one.
pub(crate) fn line_node<'a>(junction: &Junction<'a>) -> Node<'a> {
    let first = junction.plan_view().geometries().first();
    first.map_or(junction.node(), |one| one.node())
}

/// Returns s and t of a point beside a straight line.
pub(crate) fn beside(line: &Placed, point: Point) -> (f64, f64) {
    let (sin, cos) = line.hdg.sin_cos();
    let (dx, dy) = (point.x - line.origin.x, point.y - line.origin.y);
    (dx * cos + dy * sin, dy * cos - dx * sin)
}

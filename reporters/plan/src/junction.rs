//! The outlines of junctions.

use qcbus_opendrive::{BoundarySegment, ContactPoint, Junction, RoadMap, SegmentStation, Side};

use crate::hull::hull;
use crate::road::RoadPlan;
use crate::section::{LanePlan, SectionPlan};
use crate::simplify::Vertex;

/// Maximum number of points of all outlines together. Many junctions may name the same roads.
const MOST_POINTS: usize = 4_000_000;

/// Access to the plans of the roads, as outlines need it.
pub(crate) trait Roads {
    /// Calls `look` with the plan of this road. Returns `None` if it cannot be drawn.
    fn with<T>(&mut self, road: usize, look: impl FnOnce(&RoadPlan<'_>) -> T) -> Option<T>;
}

/// Builder of outlines that stops at the limit of its work.
pub(crate) struct Outlines {
    left: usize,
    /// Roads that belong to a junction by their own attribute, by the index of the junction.
    members: Vec<Vec<usize>>,
    /// Cached hulls of roads.
    hulls: std::collections::HashMap<usize, Vec<[i64; 2]>>,
}

impl Outlines {
    pub(crate) fn new(map: &RoadMap<'_>) -> Outlines {
        let mut members = vec![Vec::new(); map.junctions().len()];
        for road in map.roads() {
            let junction = road.junction().and_then(|id| map.junction(id));
            let slot = junction.and_then(|junction| members.get_mut(junction.index()));
            if let Some(slot) = slot {
                slot.push(road.index());
            }
        }
        Outlines {
            left: MOST_POINTS,
            members,
            hulls: std::collections::HashMap::new(),
        }
    }

    /// Checks whether points were left out because of the limit.
    pub(crate) fn is_spent(&self) -> bool {
        self.left == 0
    }

    /// Returns the outline of a junction: its boundary (12.10) if it can be drawn. Otherwise it is
    /// the convex hull of the borders of its connecting roads.
    pub(crate) fn outline(
        &mut self,
        map: &RoadMap<'_>,
        junction: &Junction<'_>,
        roads: &mut impl Roads,
    ) -> Vec<[i64; 2]> {
        let boundary = junction.boundary().and_then(|boundary| {
            let mut points = Vec::new();
            for segment in boundary.segments() {
                let road = map.road(segment.road_id()?)?;
                let length = road.length()?;
                let along = roads.with(road.index(), |plan| along(plan, segment, length))??;
                self.left = self.left.checked_sub(along.len())?;
                points.extend(along);
            }
            points.dedup();
            (points.len() > 2).then_some(points)
        });
        boundary.unwrap_or_else(|| self.around(map, junction, roads))
    }

    fn around(
        &mut self,
        map: &RoadMap<'_>,
        junction: &Junction<'_>,
        roads: &mut impl Roads,
    ) -> Vec<[i64; 2]> {
        let named = junction
            .connections()
            .filter_map(|each| map.road(each.connecting_road()?));
        let mut connecting: Vec<usize> = named.map(|road| road.index()).collect();
        connecting.extend(self.members.get(junction.index()).into_iter().flatten());
        connecting.sort_unstable();
        connecting.dedup();
        let mut points = Vec::new();
        for road in connecting {
            let own = self.hulls.entry(road).or_insert_with(|| {
                roads
                    .with(road, |plan| hull(coarse(plan)))
                    .unwrap_or_default()
            });
            if own.len() > self.left {
                self.left = 0;
                break;
            }
            self.left -= own.len();
            points.extend_from_slice(own);
        }
        hull(points)
    }
}

/// Returns the points of all borders of a road without those of the finest level of detail.
fn coarse(plan: &RoadPlan<'_>) -> Vec<[i64; 2]> {
    let lanes = plan.sections.iter().flat_map(|section| {
        let lanes = section.left.iter().chain(&section.right);
        let borders = lanes.map(|lane| &lane.border);
        std::iter::once(&section.center).chain(borders)
    });
    let lines = lanes.map(|border| &border.line);
    let vertices = lines.flatten().filter(|vertex| vertex.level > 0);
    vertices.map(|vertex| vertex.at).collect()
}

/// Returns the part of a boundary that a segment describes, in the direction of the segment.
fn along(plan: &RoadPlan<'_>, segment: BoundarySegment<'_>, length: f64) -> Option<Vec<[i64; 2]>> {
    match segment.kind()? {
        "lane" => {
            let station = |given| match given {
                SegmentStation::S(s) => s,
                SegmentStation::End(ContactPoint::Start) => 0.0,
                SegmentStation::End(ContactPoint::End) => length,
            };
            let (from, to) = (station(segment.s_start()?), station(segment.s_end()?));
            let mut points = stretch(plan, segment.boundary_lane()?, [from.min(to), from.max(to)]);
            if from > to {
                points.reverse();
            }
            Some(points)
        }
        "joint" => {
            let end = segment.contact_point()?;
            let lanes = [segment.joint_lane_start(), segment.joint_lane_end()];
            let corners = lanes.into_iter().flatten();
            let corners = corners.map(|lane| corner(plan, lane, end));
            corners.collect()
        }
        _ => None,
    }
}

/// Returns the outer border of a lane within a stretch of road.
fn stretch(plan: &RoadPlan<'_>, lane: i64, [from, to]: [f64; 2]) -> Vec<[i64; 2]> {
    let lines = plan
        .sections
        .iter()
        .filter_map(|section| line(section, lane));
    let mut points = Vec::new();
    for line in lines {
        for pair in line.windows(2) {
            let [one, next] = [&pair[0], &pair[1]];
            if next.s >= from && one.s <= to {
                points.extend([from.max(one.s), to.min(next.s)].map(|s| between(one, next, s)));
            }
        }
    }
    points.dedup();
    points
}

/// Returns the place at `s` on the line between two points.
fn between(one: &Vertex, next: &Vertex, s: f64) -> [i64; 2] {
    let length = next.s - one.s;
    let share = if length > 0.0 {
        (s - one.s) / length
    } else {
        0.0
    };
    [0, 1].map(|axis| {
        let way = (next.at[axis] - one.at[axis]) as f64;
        one.at[axis] + (share * way).round() as i64
    })
}

/// Returns the point at which the outer border of a lane meets an end of the road.
fn corner(plan: &RoadPlan<'_>, lane: i64, end: ContactPoint) -> Option<[i64; 2]> {
    let mut lines = plan
        .sections
        .iter()
        .filter_map(|section| line(section, lane));
    let vertex = match end {
        ContactPoint::Start => lines.next()?.first()?,
        ContactPoint::End => lines.next_back()?.last()?,
    };
    Some(vertex.at)
}

/// Returns the outer border of a lane, or the center line for lane 0.
fn line<'p>(section: &'p SectionPlan<'_>, lane: i64) -> Option<&'p [Vertex]> {
    let of_id = |lanes: &'p [LanePlan<'_>]| lanes.iter().find(|each| each.id == lane);
    let border = match Side::of_lane_id(lane) {
        None => &section.center,
        Some(Side::Left) => &of_id(&section.left)?.border,
        Some(Side::Right) => &of_id(&section.right)?.border,
    };
    Some(&border.line)
        .filter(|line| !line.is_empty())
        .map(Vec::as_slice)
}

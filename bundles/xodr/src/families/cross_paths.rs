//! Roads that cross others as cross paths (OpenDRIVE 1.9, 12.5 and 12.7.1).

use super::virtual_junctions::seen_from;
use crate::prelude::*;
use qcbus_opendrive::CrossPath;
use qcbus_opendrive::CrossPathLaneLink;

/// A cross path with its crossing road.
pub(crate) struct Crossing<'m, 'a> {
    pub junction: &'m Junction<'a>,
    pub path: CrossPath<'a>,
    pub road: &'m Road<'a>,
}

/// One end of a crossing road and the lane to which it is linked.
pub(crate) struct Landing<'m, 'a> {
    pub link: CrossPathLaneLink<'a>,
    pub end: ContactPoint,
    /// The crossed road; `s` is the position on it.
    pub other: &'m Road<'a>,
    pub s: f64,
    pub lane: i64,
}

/// Returns all cross paths whose crossing road exists.
pub(crate) fn crossings<'m, 'a>(map: &'m RoadMap<'a>) -> impl Iterator<Item = Crossing<'m, 'a>> {
    map.junctions().iter().flat_map(move |junction| {
        junction.cross_paths().filter_map(move |path| {
            let road = map.road(path.crossing_road()?)?;
            Some(Crossing {
                junction,
                path,
                road,
            })
        })
    })
}

impl<'m, 'a> Crossing<'m, 'a> {
    /// Returns the landings whose link is complete.
    pub fn landings(&self, map: &'m RoadMap<'a>) -> impl Iterator<Item = Landing<'m, 'a>> {
        ContactPoint::BOTH.into_iter().filter_map(|end| {
            let link = self.path.lane_link(end)?;
            Some(Landing {
                link,
                end,
                other: map.road(self.path.road_at(end)?)?,
                s: link.s()?,
                lane: link.from()?,
            })
        })
    }

    /// Returns the middle of a lane at an end of the crossing road.
    pub fn middle(&self, end: ContactPoint, lane: i64) -> Option<Point> {
        let side = Side::of_lane_id(lane)?;
        let section = self.road.permanent()?.end_section(self.road, side, end)?;
        let [inner, outer] = section
            .lane(lane)?
            .borders_at(end)?
            .map(|border| border.point.plan());
        Point::finite(0.5 * (inner.x + outer.x), 0.5 * (inner.y + outer.y))
    }

    /// Returns both corners of the crossing road at one of its ends.
    pub fn corners(&self, end: ContactPoint) -> Option<[Point; 2]> {
        let pose = self.road.end_pose(end)?;
        let corner = |side: Side| {
            let section = self.road.permanent()?.end_section(self.road, side, end)?;
            let lane = section.side(side).next_back();
            let t = match lane {
                Some(lane) => lane.t(Edge::Outer, lane.end_station(end)?)?,
                None => section.center_t(match end {
                    ContactPoint::Start => Station::at(0.0),
                    ContactPoint::End => Station::before(section.length(side)?),
                })?,
            };
            pose.beside(t)
        };
        Some([corner(Side::Left)?, corner(Side::Right)?])
    }
}

impl Landing<'_, '_> {
    /// Returns s and t on the crossed road for a point near the landing. It moves along the road
    /// from `@s` to the foot of the perpendicular in a few steps.
    pub fn project(&self, point: Point) -> Option<(f64, f64)> {
        let length = self.other.length().filter(|length| *length >= 0.0)?;
        let mut s = self.s;
        for _ in 0..8 {
            let (ahead, left) = seen_from(self.other.pose(s)?, point);
            if ahead.abs() < 1e-6 {
                return Some((s, left));
            }
            s = (s + ahead).clamp(0.0, length);
        }
        let (_, left) = seen_from(self.other.pose(s)?, point);
        Some((s, left))
    }

    /// Returns the extent in t of the linked lane at s, smaller value first.
    pub fn span(&self, s: f64) -> Option<[f64; 2]> {
        let side = Side::of_lane_id(self.lane)?;
        let end = self.other.length()?;
        let station = if s >= end {
            Station::before(end)
        } else {
            Station::at(s)
        };
        let section = self
            .other
            .permanent()?
            .section_at(self.other, side, station)?;
        let lane = section.lane(self.lane)?;
        let ds = station.shifted(-section.s()?);
        let (inner, outer) = (lane.inner_t(ds)?, lane.outer_t(ds)?);
        Some([inner.min(outer), inner.max(outer)])
    }
}

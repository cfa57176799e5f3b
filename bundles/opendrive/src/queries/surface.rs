//! Points in space: the s/t/h system of a road and the surface of its lanes (OpenDRIVE 1.9, 8.3,
//! 10.5, 11.7.3, 11.7.4).

use crate::geometry::{Point3, Pose, finite};
use crate::queries::lane_ref::{Edge, LaneRef};
use crate::types::frame::{BorderPoint, Frame};
use crate::types::lane::Borders;
use crate::types::plan_view::END_TOLERANCE;
use crate::types::road::Road;
use crate::types::station::Station;
use crate::types::value::{ContactPoint, Side};

impl<'a> Road<'a> {
    /// Returns the cross section at `s`.
    pub fn frame(&self, s: impl Into<Station>) -> Option<Frame> {
        let s = s.into();
        self.frame_on(self.pose(s)?, s)
    }

    /// Returns the cross section at an end of the road, at the true start or end of the reference
    /// line.
    pub fn end_frame(&self, end: ContactPoint) -> Option<Frame> {
        self.end_frame_or(end, || {
            let station = match end {
                ContactPoint::Start => Station::at(0.0),
                ContactPoint::End => Station::before(self.length()?),
            };
            self.frame_on(self.end_pose(end)?, station)
        })
    }

    fn frame_on(&self, pose: Pose, s: Station) -> Option<Frame> {
        let superelevation = &self.lateral().superelevation;
        Some(Frame {
            pose,
            z: self.elevation().at_or_zero(s)?,
            roll: superelevation.at_or_zero(s)?,
            slope: self.elevation().slope_or_zero(s)?,
            roll_slope: superelevation.slope_or_zero(s)?,
        })
    }

    /// Returns the point with the road coordinates (s, t, h). h is perpendicular to the plane that
    /// superelevation tilts. There is no pitch (8.3).
    pub fn point(&self, s: impl Into<Station>, t: f64, h: f64) -> Option<Point3> {
        let frame = self.frame(s)?;
        let (lateral, up) = frame.tilted(t, h);
        frame.place(lateral, up)
    }

    /// Returns the point of the road's surface at (s, t). It is a [`point`](Road::point) at the
    /// height of the shape or cross section surface. Lane height and `@level` are ignored.
    pub fn surface_point(&self, s: impl Into<Station>, t: f64) -> Option<Point3> {
        let s = s.into();
        self.point(s, t, self.lateral().height(s, t)?)
    }
}

/// Position of a lane's border in its cross section: to the left and up, in metres, with the change
/// of both over s.
#[derive(Debug, Clone, Copy)]
struct Lay {
    lateral: f64,
    up: f64,
    lateral_slope: f64,
    up_slope: f64,
}

impl<'m, 'a> LaneRef<'m, 'a> {
    /// Returns a border at `ds` metres from the section's start.
    pub fn border(self, edge: Edge, ds: impl Into<Station>) -> Option<BorderPoint> {
        let ds = ds.into();
        let frame = self.at.road.frame(ds.shifted(self.at.s()?))?;
        self.border_in(frame, edge, ds)
    }

    /// Returns a border at an end of the section. At an end of the road, the end of the reference
    /// line counts, regardless of `@length`.
    pub fn border_at(self, edge: Edge, end: ContactPoint) -> Option<BorderPoint> {
        let [inner, outer] = self.end_borders(end);
        match edge {
            Edge::Inner => *inner,
            Edge::Outer => *outer,
        }
    }

    /// Returns both borders at an end of the section, inner and outer; see [`LaneRef::border_at`].
    pub fn borders_at(self, end: ContactPoint) -> Option<[BorderPoint; 2]> {
        let [inner, outer] = *self.end_borders(end);
        Some([inner?, outer?])
    }

    fn end_borders(self, end: ContactPoint) -> &'m Borders {
        let find = || {
            let Some((frame, station)) = self.frame_at(end).zip(self.end_station(end)) else {
                return [None; 2];
            };
            Edge::BOTH.map(|edge| self.border_in(frame, edge, station))
        };
        self.lane().borders_or(end, find)
    }

    /// Returns the cross section of the road at an end of the section.
    fn frame_at(self, end: ContactPoint) -> Option<Frame> {
        if self.is_at_road_end(end) {
            return self.at.road.end_frame(end);
        }
        let ds = self.end_station(end)?;
        self.at.road.frame(ds.shifted(self.at.s()?))
    }

    /// Checks whether an end of the section is an end of the road.
    pub fn is_at_road_end(self, end: ContactPoint) -> bool {
        let side = self.side().unwrap_or(Side::Right);
        let beside = self.at.neighbour(side, end).is_none();
        let place = match end {
            ContactPoint::Start => self.at.s().map(|s| s <= 1e-9),
            ContactPoint::End => {
                let ends = self.at.end(side).zip(self.at.road.length());
                // The tolerance is needed because the end of a temporary section is a sum.
                ends.map(|(one, other)| (one - other).abs() <= END_TOLERANCE)
            }
        };
        beside && place == Some(true)
    }

    /// Returns the point of the lane's surface at a fraction of its width: 0 is the inner and 1 the
    /// outer border.
    pub fn surface_point(self, ds: impl Into<Station>, share: f64) -> Option<Point3> {
        let ds = ds.into();
        let frame = self.at.road.frame(ds.shifted(self.at.s()?))?;
        let (inner, outer) = (self.inner_t(ds)?, self.outer_t(ds)?);
        let t = inner + share * (outer - inner);
        let lay = self.lay(frame, t, 0.0, ds)?;
        let (low, high) = self.lift(ds)?;
        frame.place(lay.lateral, lay.up + low + share * (high - low))
    }

    fn border_in(self, frame: Frame, edge: Edge, ds: Station) -> Option<BorderPoint> {
        let [t, t_slope] = self.t_and_slope(edge, ds)?;
        let lay = self.lay(frame, t, t_slope, ds)?;
        let (inner, outer) = self.lift(ds)?;
        let lift = match edge {
            Edge::Inner => inner,
            Edge::Outer => outer,
        };
        // The border is r(s) + lateral(s)·n(s); its derivative along the tangent is 1 - κ·lateral.
        let ahead = 1.0 - frame.pose.curvature * lay.lateral;
        let turn = (ahead > 0.0).then(|| lay.lateral_slope.atan2(ahead));
        let slope = finite(frame.slope + lay.up_slope)?;
        let stretch = ahead.hypot(lay.lateral_slope);
        Some(BorderPoint {
            t,
            point: frame.place(lay.lateral, lay.up + lift)?,
            hdg: turn.and_then(|turn| finite(frame.pose.hdg + turn)),
            slope,
            grade: turn.and_then(|_| finite(slope / stretch)),
        })
    }

    /// Returns the position of t in the cross section. On a lane with `@level`, the surface is
    /// horizontal from the outer border of the last lane without it (11.7.4).
    fn lay(self, frame: Frame, t: f64, t_slope: f64, ds: Station) -> Option<Lay> {
        if !self.level()? {
            return self.tilted_lay(frame, t, t_slope, ds);
        }
        let mut hinge = self;
        while let Some(inner) = hinge
            .inner_neighbour()
            .filter(|lane| lane.level() == Some(true))
        {
            hinge = inner;
        }
        let [hinge_t, hinge_slope] = hinge.t_and_slope(Edge::Inner, ds)?;
        let lay = self.tilted_lay(frame, hinge_t, hinge_slope, ds)?;
        Some(Lay {
            lateral: lay.lateral + (t - hinge_t),
            lateral_slope: lay.lateral_slope + (t_slope - hinge_slope),
            ..lay
        })
    }

    fn tilted_lay(self, frame: Frame, t: f64, t_slope: f64, ds: Station) -> Option<Lay> {
        let height = self.at.road.lateral().height(ds.shifted(self.at.s()?), t)?;
        let (lateral, up) = frame.tilted(t, height);
        let (sin, cos) = frame.tilt();
        Some(Lay {
            lateral,
            up,
            lateral_slope: t_slope * cos - up * frame.roll_slope,
            up_slope: t_slope * sin + lateral * frame.roll_slope,
        })
    }
}

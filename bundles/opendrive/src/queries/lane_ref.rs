//! A lane within its section and road: its borders and widths (OpenDRIVE 1.9, 11.7).

use std::ops::Deref;

use crate::geometry::finite;
use crate::queries::section_ref::SectionRef;
use crate::types::contacts::{LaneEnd, LaneKey};
use crate::types::lane::{Lane, LaneGroup};
use crate::types::profile::Profile;
use crate::types::station::Station;
use crate::types::value::{ContactPoint, Side};

/// One of the two borders of a lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Edge {
    /// The border nearer to the center lane.
    Inner,
    /// The border farther from the center lane.
    Outer,
}

impl Edge {
    /// Both borders.
    pub const BOTH: [Edge; 2] = [Edge::Inner, Edge::Outer];
}

/// A lane with its section, layer and road.
#[derive(Debug, Clone, Copy)]
pub struct LaneRef<'m, 'a> {
    /// The section.
    pub at: SectionRef<'m, 'a>,
    lane: &'m Lane<'a>,
    index: u32,
}

impl<'a> Deref for LaneRef<'_, 'a> {
    type Target = Lane<'a>;

    #[inline]
    fn deref(&self) -> &Lane<'a> {
        self.lane
    }
}

impl<'m, 'a> LaneRef<'m, 'a> {
    #[inline]
    pub(crate) fn new(at: SectionRef<'m, 'a>, index: usize) -> Option<LaneRef<'m, 'a>> {
        let lane = at.section().own_lanes().get(index)?;
        let index = u32::try_from(index).ok()?;
        Some(LaneRef { at, lane, index })
    }

    /// Returns the lane itself.
    #[inline]
    pub fn lane(self) -> &'m Lane<'a> {
        self.lane
    }

    /// Returns the key of the lane in the map.
    #[inline]
    pub fn key(self) -> LaneKey {
        let narrow = |index: usize| u32::try_from(index).unwrap_or(u32::MAX);
        LaneKey {
            road: narrow(self.at.road.index()),
            layer: narrow(self.at.layer.index()),
            section: narrow(self.at.index()),
            lane: self.index,
        }
    }

    /// Returns the side that contains the lane, or `None` for the center lane.
    #[inline]
    pub fn side(self) -> Option<Side> {
        self.lane.group().side()
    }

    /// Returns the length of the section for the side of this lane, in metres.
    #[inline]
    pub fn length(self) -> Option<f64> {
        self.at.length(self.side().unwrap_or(Side::Right))
    }

    /// Returns the station at an end of the section: at its start, or just before its end.
    #[inline]
    pub fn end_station(self, end: ContactPoint) -> Option<Station> {
        match end {
            ContactPoint::Start => Some(Station::at(0.0)),
            ContactPoint::End => self
                .length()
                .filter(|length| *length > 0.0)
                .map(Station::before),
        }
    }

    /// Returns the width at `ds` metres from the section's start: from `<width>`, or from two
    /// `<border>`s if the side has no widths. Negative in faulty files; zero for the center lane.
    pub fn width(self, ds: impl Into<Station>) -> Option<f64> {
        let ds = ds.into();
        let Some(side) = self.side() else {
            return Some(0.0);
        };
        if self.at.has_widths(side) {
            return self.widths().at(ds);
        }
        finite((self.outer_t(ds)? - self.inner_t(ds)?) * side.sign())
    }

    /// Returns the width at an end of the section.
    pub fn width_at(self, end: ContactPoint) -> Option<f64> {
        self.width(self.end_station(end)?)
    }

    /// Returns t of the outer border at `ds` for a given t of the inner border.
    #[inline]
    pub(crate) fn outer_from(self, by_width: bool, inner: f64, ds: Station) -> Option<f64> {
        let side = self.side()?;
        if by_width {
            finite(inner + side.sign() * self.widths().at(ds)?)
        } else {
            // By 11.7.2, the border is independent of the inner border. It is also independent of
            // the lane offset, which is not allowed beside it.
            self.borders().at(ds)
        }
    }

    /// Returns t of a border at `ds` metres from the section's start. Returns `None` if an inner
    /// width is undefined or the ids do not define the order of the lanes.
    pub fn t(self, edge: Edge, ds: impl Into<Station>) -> Option<f64> {
        let center = |section: SectionRef<'m, 'a>, station| section.center_t(station).map(|t| [t]);
        let [t] = self.sum(
            edge,
            ds.into(),
            |profile, at| Some([profile.at(at)?]),
            center,
        )?;
        Some(t)
    }

    /// Returns t of the inner border.
    pub fn inner_t(self, ds: impl Into<Station>) -> Option<f64> {
        self.t(Edge::Inner, ds)
    }

    /// Returns t of the outer border.
    pub fn outer_t(self, ds: impl Into<Station>) -> Option<f64> {
        self.t(Edge::Outer, ds)
    }

    /// Returns t of a border and its slope dt/ds.
    pub(crate) fn t_and_slope(self, edge: Edge, ds: Station) -> Option<[f64; 2]> {
        self.sum(edge, ds, Profile::both_at, |section, station| {
            Some([section.center_t(station)?, section.center_slope(station)?])
        })
    }

    /// Sums up the values of `part` over the profiles from the center to the border of this lane.
    fn sum<const N: usize>(
        self,
        edge: Edge,
        ds: Station,
        part: impl Fn(&Profile<'a>, Station) -> Option<[f64; N]>,
        center: impl Fn(SectionRef<'m, 'a>, Station) -> Option<[f64; N]>,
    ) -> Option<[f64; N]> {
        let Some(side) = self.side() else {
            return center(self.at, ds);
        };
        if !self.at.is_numbered(side) {
            return None;
        }
        let by_width = self.at.has_widths(side);
        let count = self.lane.rank() as usize + usize::from(edge == Edge::Outer);
        if count == 0 {
            return center(self.at, ds);
        }
        if !by_width {
            let lane = self.at.side(side).nth(count - 1)?;
            return part(lane.borders(), ds);
        }
        let mut sum = center(self.at, ds)?;
        for lane in self.at.side(side).take(count) {
            for (sum, more) in sum.iter_mut().zip(part(lane.widths(), ds)?) {
                *sum += side.sign() * more;
            }
        }
        sum.iter().all(|value| value.is_finite()).then_some(sum)
    }

    /// Returns the next lane towards the center on the same side, or `None` for the innermost lane.
    pub fn inner_neighbour(self) -> Option<LaneRef<'m, 'a>> {
        self.at
            .side_lane(self.side()?, self.lane.rank().checked_sub(1)?)
    }
}

impl LaneEnd {
    /// Returns an end of a lane.
    pub fn of(lane: LaneRef<'_, '_>, end: ContactPoint) -> LaneEnd {
        LaneEnd {
            lane: lane.key(),
            end,
        }
    }
}

impl<'m, 'a> SectionRef<'m, 'a> {
    /// Returns the lanes in document order.
    #[inline]
    pub fn lanes(self) -> impl Iterator<Item = LaneRef<'m, 'a>> {
        (0..self.section().own_lanes().len()).filter_map(move |at| self.lane_at(at))
    }

    /// Returns the lane at a place in document order.
    #[inline]
    pub fn lane_at(self, index: usize) -> Option<LaneRef<'m, 'a>> {
        LaneRef::new(self, index)
    }

    /// Returns the first lane with this id, in any group.
    pub fn lane(self, id: i64) -> Option<LaneRef<'m, 'a>> {
        let lanes = self.section().own_lanes();
        let distance = id.unsigned_abs();
        let of_side = Side::BOTH.into_iter().flat_map(|side| {
            let outward = self.section().outward(side);
            let from = outward.partition_point(|at| lanes[*at as usize].distance() < distance);
            let rest = outward.get(from..).unwrap_or(&[]).iter();
            rest.take_while(move |at| lanes[**at as usize].distance() == distance)
                .copied()
        });
        let found = of_side
            .filter(|at| lanes[*at as usize].id() == Some(id))
            .min();
        let center = self.center().filter(|lane| lane.id() == Some(id));
        found.and_then(|at| self.lane_at(at as usize)).or(center)
    }

    /// Returns the lanes of a side, from the center outward.
    #[inline]
    pub fn side(self, side: Side) -> impl DoubleEndedIterator<Item = LaneRef<'m, 'a>> {
        let places = self.section().outward(side).iter();
        places.filter_map(move |at| self.lane_at(*at as usize))
    }

    /// Returns the lane of a side with this rank, counted from the center outward from zero.
    pub(crate) fn side_lane(self, side: Side, rank: u32) -> Option<LaneRef<'m, 'a>> {
        let place = self.section().outward(side).get(rank as usize)?;
        self.lane_at(*place as usize)
    }

    /// Returns the center lane.
    pub fn center(self) -> Option<LaneRef<'m, 'a>> {
        self.lanes().find(|lane| lane.group() == LaneGroup::Center)
    }
}

//! A lane section within its road: its lanes side by side (OpenDRIVE 1.9, 11.3 to 11.5, 11.7).

use std::ops::Deref;

use crate::lane::LaneGroup;
use crate::lane_ref::LaneRef;
use crate::lanes::{LaneLayer, LaneSection};
use crate::road::Road;
use crate::station::Station;
use crate::value::{ContactPoint, Side};

/// A lane section with its road and layer.
#[derive(Debug, Clone, Copy)]
pub struct SectionRef<'m, 'a> {
    /// The road.
    pub road: &'m Road<'a>,
    /// The layer.
    pub layer: &'m LaneLayer<'a>,
    section: &'m LaneSection<'a>,
}

impl<'a> Deref for SectionRef<'_, 'a> {
    type Target = LaneSection<'a>;

    #[inline]
    fn deref(&self) -> &LaneSection<'a> {
        self.section
    }
}

impl<'m, 'a> SectionRef<'m, 'a> {
    #[inline]
    pub(crate) fn new(
        road: &'m Road<'a>,
        layer: &'m LaneLayer<'a>,
        section: &'m LaneSection<'a>,
    ) -> SectionRef<'m, 'a> {
        SectionRef {
            road,
            layer,
            section,
        }
    }

    /// Returns the section itself.
    #[inline]
    pub fn section(self) -> &'m LaneSection<'a> {
        self.section
    }

    /// Returns the lanes in document order.
    #[inline]
    pub fn lanes(self) -> impl Iterator<Item = LaneRef<'m, 'a>> {
        (0..self.section.own_lanes().len()).filter_map(move |at| self.lane_at(at))
    }

    /// Returns the lane at a place in document order.
    #[inline]
    pub fn lane_at(self, index: usize) -> Option<LaneRef<'m, 'a>> {
        LaneRef::new(self, index)
    }

    /// Returns the first lane with this id, in any group.
    pub fn lane(self, id: i64) -> Option<LaneRef<'m, 'a>> {
        let lanes = self.section.own_lanes();
        let distance = id.unsigned_abs();
        let of_side = Side::BOTH.into_iter().flat_map(|side| {
            let outward = self.section.outward(side);
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
        let places = self.section.outward(side).iter();
        places.filter_map(move |at| self.lane_at(*at as usize))
    }

    /// Returns the lane of a side with this rank, counted from the center outward from zero.
    pub(crate) fn side_lane(self, side: Side, rank: u32) -> Option<LaneRef<'m, 'a>> {
        let place = self.section.outward(side).get(rank as usize)?;
        self.lane_at(*place as usize)
    }

    /// Returns the center lane.
    pub fn center(self) -> Option<LaneRef<'m, 'a>> {
        self.lanes().find(|lane| lane.group() == LaneGroup::Center)
    }

    /// Returns the next section for a side.
    #[inline]
    pub fn next(self, side: Side) -> Option<SectionRef<'m, 'a>> {
        self.neighbour(side, ContactPoint::End)
    }

    /// Returns the previous section for a side.
    #[inline]
    pub fn previous(self, side: Side) -> Option<SectionRef<'m, 'a>> {
        self.neighbour(side, ContactPoint::Start)
    }

    /// Returns the section that touches this one at an end, for a side, by order of `@s`.
    #[inline]
    pub fn neighbour(self, side: Side, end: ContactPoint) -> Option<SectionRef<'m, 'a>> {
        let place = self.section.beside(side, end)?;
        self.layer.section(self.road, place as usize)
    }

    /// Returns t of the center lane at `ds` metres from the section's start: its offset (11.5).
    #[inline]
    pub fn center_t(self, ds: impl Into<Station>) -> Option<f64> {
        self.layer.offset().at_or_zero(ds.into().shifted(self.s()?))
    }

    /// Returns the slope dt/ds of the center lane at `ds`.
    pub(crate) fn center_slope(self, ds: Station) -> Option<f64> {
        self.layer.offset().slope_or_zero(ds.shifted(self.s()?))
    }

    /// Returns the cross section of a side at `ds` metres from the section's start. Each lane has t
    /// of its inner and outer border. Lanes run from the center outward, as far as they are
    /// defined.
    pub fn spans(self, side: Side, ds: impl Into<Station>) -> Vec<LaneSpan<'m, 'a>> {
        self.each_span(side, ds).collect()
    }

    /// Returns the same lanes as [`SectionRef::spans`], one after the other.
    #[inline]
    pub fn each_span(
        self,
        side: Side,
        ds: impl Into<Station>,
    ) -> impl Iterator<Item = LaneSpan<'m, 'a>> {
        let ds = ds.into();
        let mut border = self.center_t(ds).filter(|_| self.is_numbered(side));
        let by_width = self.has_widths(side);
        self.side(side).map_while(move |lane| {
            let inner = border?;
            let outer = lane.outer_from(by_width, inner, ds)?;
            border = Some(outer);
            Some(LaneSpan { lane, inner, outer })
        })
    }

    /// Returns t of the outermost border of a side at `ds`, or of the center without lanes.
    pub fn edge_t(self, side: Side, ds: impl Into<Station>) -> Option<f64> {
        let ds = ds.into();
        match self.side(side).next_back() {
            Some(lane) => lane.outer_t(ds),
            None => self.center_t(ds),
        }
    }

    /// Checks whether a lane of the side has `<width>` records. If so, `<border>` records of the
    /// side do not count (11.7.2).
    pub fn has_widths(self, side: Side) -> bool {
        let any = |side| self.side(side).any(|lane| !lane.widths().is_empty());
        self.section.widths_or(side, any)
    }
}

/// A lane with its extent in t.
#[derive(Debug, Clone, Copy)]
pub struct LaneSpan<'m, 'a> {
    /// The lane.
    pub lane: LaneRef<'m, 'a>,
    /// t of the border nearer to the center, in metres.
    pub inner: f64,
    /// t of the border farther from the center, in metres.
    pub outer: f64,
}

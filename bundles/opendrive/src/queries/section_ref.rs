//! A lane section within its road, and its neighbours (OpenDRIVE 1.9, 11.3 to 11.5).

use std::ops::Deref;

use crate::types::lane_section::{LaneLayer, LaneSection};
use crate::types::road::Road;
use crate::types::station::Station;
use crate::types::value::{ContactPoint, Side};

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
}

impl<'a> Road<'a> {
    /// Returns all lane sections of all layers, in document order.
    #[inline]
    pub fn sections(&self) -> impl Iterator<Item = SectionRef<'_, 'a>> {
        self.layers().iter().flat_map(|layer| layer.sections(self))
    }
}

impl<'a> LaneLayer<'a> {
    /// Returns the sections in document order. `road` is the road of the layer.
    #[inline]
    pub fn sections<'m>(
        &'m self,
        road: &'m Road<'a>,
    ) -> impl DoubleEndedIterator<Item = SectionRef<'m, 'a>> {
        self.steps
            .items()
            .iter()
            .map(move |section| SectionRef::new(road, self, section))
    }

    /// Returns the section at a place in document order.
    #[inline]
    pub fn section<'m>(&'m self, road: &'m Road<'a>, index: usize) -> Option<SectionRef<'m, 'a>> {
        let section = self.steps.items().get(index)?;
        Some(SectionRef::new(road, self, section))
    }

    /// Returns the sections in ascending order of `@s`. Returns none if a section has no `@s`.
    pub fn in_order<'m>(
        &'m self,
        road: &'m Road<'a>,
    ) -> impl DoubleEndedIterator<Item = SectionRef<'m, 'a>> {
        self.steps
            .in_order()
            .map(move |section| SectionRef::new(road, self, section))
    }

    /// Returns the section that is valid for a side at `s`. This is the last section of the side
    /// that starts at or before `s`, unless it has ended.
    pub fn section_at<'m>(
        &'m self,
        road: &'m Road<'a>,
        side: Side,
        s: impl Into<Station>,
    ) -> Option<SectionRef<'m, 'a>> {
        let station = s.into();
        let last = self.steps.index(self.steps.rank_at(station)?)?;
        let mut section = self.section(road, last)?;
        if !section.covers(side) {
            section = section.previous(side)?;
        }
        let over = section.end(side).is_some_and(|end| station.is_after(end));
        let at_very_end = section.next(side).is_none() && section.end(side) == Some(station.x());
        (!over || at_very_end).then_some(section)
    }

    /// Returns the first or last section that is valid for a side.
    pub fn end_section<'m>(
        &'m self,
        road: &'m Road<'a>,
        side: Side,
        end: ContactPoint,
    ) -> Option<SectionRef<'m, 'a>> {
        self.section(road, self.terminal(side, end)?)
    }
}

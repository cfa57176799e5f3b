//! Cross section of a lane section: its lanes side by side with their borders (OpenDRIVE 1.9,
//! 11.7).

use crate::queries::lane_ref::LaneRef;
use crate::queries::section_ref::SectionRef;
use crate::types::station::Station;
use crate::types::value::Side;

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

impl<'m, 'a> SectionRef<'m, 'a> {
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
}

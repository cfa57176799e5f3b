//! Borders of the lanes of a section, as polynomials of t between two stations at which records
//! begin.

use qcbus_opendrive::geometry::Cubic;
use qcbus_opendrive::{LaneRef, SectionRef, Side};

use crate::frame::valid;

/// One side of a section.
pub(crate) struct Flank<'m, 'a> {
    pub(crate) side: Side,
    /// Lanes from the center outward.
    pub(crate) lanes: Vec<LaneRef<'m, 'a>>,
    /// Whether the ids give the order of the lanes. Otherwise the lanes have no borders.
    pub(crate) ordered: bool,
    by_width: bool,
    /// End of the side along the road, in metres.
    end: f64,
}

impl<'m, 'a> Flank<'m, 'a> {
    pub(crate) fn of(section: SectionRef<'m, 'a>, side: Side) -> Flank<'m, 'a> {
        Flank {
            side,
            lanes: section.side(side).collect(),
            ordered: section.is_numbered(side),
            by_width: section.has_widths(side),
            end: section.end(side).unwrap_or(f64::INFINITY),
        }
    }

    /// Returns the lanes that have borders.
    pub(crate) fn bordered(&self) -> &[LaneRef<'m, 'a>] {
        if self.ordered { &self.lanes } else { &[] }
    }

    /// Appends t of the outer borders over the distance from `from`, outward from `center`. A lane
    /// has no width if the width is undefined or the side has already ended.
    pub(crate) fn push(&self, start: f64, from: f64, center: Cubic, borders: &mut Vec<Cubic>) {
        let mut last = center;
        for lane in self.bordered() {
            let ds = from - start;
            let record = if from >= self.end {
                None
            } else if self.by_width {
                let width = valid(lane.widths(), ds);
                width.map(|width| last.minus(&width.scaled(-self.side.sign())))
            } else {
                valid(lane.borders(), ds)
            };
            last = record.unwrap_or(last);
            borders.push(last);
        }
    }

    /// Appends the stations at which a record of this side begins, in metres along the road.
    pub(crate) fn breaks(&self, start: f64, breaks: &mut Vec<f64>) {
        breaks.push(self.end);
        for lane in self.bordered() {
            let profile = if self.by_width {
                lane.widths()
            } else {
                lane.borders()
            };
            let starts = profile.records().iter().filter_map(|record| record.start());
            breaks.extend(starts.map(|offset| start + offset));
            breaks.extend(mark_starts(*lane).map(|offset| start + offset));
        }
    }
}

/// Returns the start of each road mark of a lane, as an offset from the start of its section.
pub(crate) fn mark_starts<'a>(lane: LaneRef<'_, 'a>) -> impl Iterator<Item = f64> + use<'a> {
    let marks = lane.lane().records_named("roadMark");
    marks.map(|mark| mark.s_offset().unwrap_or(0.0).max(0.0))
}

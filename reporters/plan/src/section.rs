//! A lane section on the plan: its borders, the road marks along them, and the widths of its lanes.

use qcbus_opendrive::geometry::Cubic;
use qcbus_opendrive::{LaneRef, Road, SectionRef, Side};

use crate::columns::{Flank, mark_starts};
use crate::frame::{Piece, Rows, valid};
use crate::origin::Spot;
use crate::sample::{NotDrawn, Sampler};
use crate::simplify::{Vertex, levels, profile};

/// Stations closer together than this, in metres, count as equal.
const SAME_STATION: f64 = 1e-6;

/// Maximum deviation of drawn widths and heights, in centimetres.
pub(crate) const TOLERANCE: f64 = 1.0;

#[derive(Debug)]
pub(crate) struct SectionPlan<'a> {
    /// Start and end along the road, in metres.
    pub(crate) s: [f64; 2],
    pub(crate) center: Border<'a>,
    pub(crate) left: Vec<LanePlan<'a>>,
    pub(crate) right: Vec<LanePlan<'a>>,
}

#[derive(Debug, Default)]
pub(crate) struct Border<'a> {
    pub(crate) line: Vec<Vertex>,
    pub(crate) marks: Vec<MarkPlan<'a>>,
}

#[derive(Debug)]
pub(crate) struct LanePlan<'a> {
    pub(crate) id: i64,
    pub(crate) kind: &'a str,
    pub(crate) border: Border<'a>,
    /// Pairs of distance from the section's start and width, in centimetres.
    pub(crate) widths: Vec<[f64; 2]>,
}

/// A road mark along some points of a border.
#[derive(Debug)]
pub(crate) struct MarkPlan<'a> {
    pub(crate) first: usize,
    pub(crate) points: usize,
    pub(crate) kind: &'a str,
    pub(crate) color: &'a str,
    /// Width in metres; zero if it is not given.
    pub(crate) width: f64,
}

/// Returns the section's part of the plan, limited to the reference line (`line`, start and end in
/// metres). `starts` are the starts of the records of the road and of those of the layer, each
/// ascending.
pub(crate) fn section<'a>(
    section: SectionRef<'_, 'a>,
    line: [f64; 2],
    starts: [&[f64]; 2],
    sampler: &mut Sampler,
) -> Result<SectionPlan<'a>, NotDrawn> {
    let flanks = [Side::Left, Side::Right].map(|side| Flank::of(section, side));
    let start = section.s().unwrap_or(f64::NAN);
    let ends = Side::BOTH.into_iter().filter(|side| section.covers(*side));
    let end = ends
        .filter_map(|side| section.end(side))
        .fold(f64::NAN, f64::max);
    let extent = [start.max(line[0]), end.min(line[1])];
    let rows = if start.is_finite() && extent[0] < extent[1] {
        rows(section, &flanks, extent, starts, sampler)?
    } else {
        Rows::default()
    };
    let column = |at: usize, lane: Option<LaneRef<'_, 'a>>| border(&rows, at, lane, start);
    let center = column(0, section.center());
    let mut at = 0;
    let [left, right] = flanks.map(|flank| {
        let lanes = flank.lanes.iter().map(|lane| {
            let mut plan = LanePlan {
                id: lane.id().unwrap_or(0),
                kind: lane.kind().unwrap_or(""),
                border: Border::default(),
                widths: Vec::new(),
            };
            if flank.ordered {
                let inner = if lane.inner_neighbour().is_some() {
                    at
                } else {
                    0
                };
                at += 1;
                plan.border = column(at, Some(*lane));
                plan.widths = widths(&rows, [inner, at], flank.side.sign(), start);
            }
            plan
        });
        lanes.collect::<Vec<_>>()
    });
    Ok(SectionPlan {
        s: [start, end],
        center,
        left,
        right,
    })
}

/// Returns the cross sections: the center, then the left side outward, then the right side outward.
fn rows(
    section: SectionRef<'_, '_>,
    flanks: &[Flank<'_, '_>; 2],
    [from, to]: [f64; 2],
    starts: [&[f64]; 2],
    sampler: &mut Sampler,
) -> Result<Rows, NotDrawn> {
    let start = section.s().unwrap_or(from);
    let mut breaks: Vec<f64> = Vec::new();
    for starts in starts {
        let first = starts.partition_point(|s| *s <= from);
        let inside = starts.get(first..).unwrap_or(&[]).iter();
        breaks.extend(inside.take_while(|s| **s < to));
    }
    for flank in flanks {
        flank.breaks(start, &mut breaks);
    }
    if let Some(center) = section.center() {
        breaks.extend(mark_starts(center).map(|offset| start + offset));
    }
    let mut rows = Rows::default();
    each_piece([from, to], breaks, |piece| {
        let columns = 1 + flanks
            .iter()
            .map(|flank| flank.bordered().len())
            .sum::<usize>();
        // This is the cost of a piece before its first row.
        sampler.left = sampler.left.checked_sub(columns).ok_or(NotDrawn::TooLong)?;
        let offset = section.layer.offset();
        let center = valid(offset, piece[0]).unwrap_or_default();
        let mut borders: Vec<Cubic> = Vec::with_capacity(columns);
        borders.push(center);
        for flank in flanks {
            flank.push(start, piece[0], center, &mut borders);
        }
        let piece = Piece::of(section.road, piece, borders).ok_or(NotDrawn::Nowhere)?;
        sampler.take(&piece, &mut rows)
    })?;
    Ok(rows)
}

/// Calls `visit` for each piece into which `breaks` divide a stretch of road.
pub(crate) fn each_piece(
    [from, to]: [f64; 2],
    mut breaks: Vec<f64>,
    mut visit: impl FnMut([f64; 2]) -> Result<(), NotDrawn>,
) -> Result<(), NotDrawn> {
    breaks.retain(|s| *s > from + SAME_STATION && *s < to - SAME_STATION);
    breaks.sort_unstable_by(f64::total_cmp);
    breaks.dedup_by(|next, last| *next - *last <= SAME_STATION);
    breaks.push(to);
    let mut start = from;
    for end in breaks {
        visit([start, end])?;
        start = end;
    }
    Ok(())
}

/// Returns one column of the rows as a line with a lane's marks; offsets count from `start`.
fn border<'a>(rows: &Rows, column: usize, lane: Option<LaneRef<'_, 'a>>, start: f64) -> Border<'a> {
    if rows.s.is_empty() {
        return Border::default();
    }
    let marks = lane.map_or_else(Vec::new, |lane| marks(lane, start));
    let begins: Vec<usize> = marks.iter().map(|mark| begin(rows, mark.s)).collect();
    let (line, places) = line(rows, column, &begins);
    let place = |row: usize| places.get(row).copied().unwrap_or(0);
    let last = rows.s.len() - 1;
    let mut drawn = Vec::new();
    for (at, mark) in marks.iter().enumerate() {
        // The mark ends at the last row before the step of the next mark.
        let end = marks.get(at + 1).map_or(last, |next| end(rows, next.s));
        let (first, end) = (place(begins[at]), place(end));
        if mark.kind != "none" && end > first {
            drawn.push(MarkPlan {
                first,
                points: end - first + 1,
                kind: mark.kind,
                color: mark.color,
                width: mark.width,
            });
        }
    }
    Border { line, marks: drawn }
}

/// Returns one column as a line that keeps the rows in `forced` (ascending). For each row it also
/// returns the index in the line of the last point up to it.
fn line(rows: &Rows, column: usize, forced: &[usize]) -> (Vec<Vertex>, Vec<usize>) {
    let spots: Vec<Spot> = rows.column(column).map(|sample| sample.at).collect();
    let mut line = Vec::new();
    let mut places = Vec::with_capacity(spots.len());
    let levels = levels(&spots, forced).into_iter();
    for ((level, spot), s) in levels.zip(&spots).zip(&rows.s) {
        if let Some(level) = level {
            line.push(Vertex {
                at: spot.rounded(),
                s: *s,
                level,
            });
        }
        places.push(line.len().saturating_sub(1));
    }
    (line, places)
}

/// Returns the reference line, which is the first column.
pub(crate) fn reference_line(rows: &Rows) -> Vec<Vertex> {
    line(rows, 0, &[]).0
}

/// A road mark as given in the map.
struct Mark<'a> {
    /// Start in metres along the road.
    s: f64,
    kind: &'a str,
    color: &'a str,
    width: f64,
}

fn marks<'a>(lane: LaneRef<'_, 'a>, start: f64) -> Vec<Mark<'a>> {
    let nodes = lane.lane().elements("roadMark");
    let written = nodes.zip(mark_starts(lane)).map(|(node, offset)| Mark {
        s: start + offset,
        kind: node.attr("type").unwrap_or(""),
        color: node.attr("color").unwrap_or(""),
        width: node.f64("width").unwrap_or(0.0),
    });
    let mut marks: Vec<Mark<'a>> = written.collect();
    marks.sort_by(|one, next| one.s.total_cmp(&next.s));
    marks
}

/// Returns the row at which a thing with start `s` begins: the last row at that station.
fn begin(rows: &Rows, s: f64) -> usize {
    let after = rows.s.partition_point(|row| *row <= s + 2.0 * SAME_STATION);
    after.saturating_sub(1)
}

/// Returns the row at which a thing with end `s` ends: the first row at that station.
fn end(rows: &Rows, s: f64) -> usize {
    let at = rows.s.partition_point(|row| *row < s - 2.0 * SAME_STATION);
    at.min(rows.s.len().saturating_sub(1))
}

/// Returns the width between two columns over the distance from the section's start, in
/// centimetres.
fn widths(rows: &Rows, [inner, outer]: [usize; 2], sign: f64, start: f64) -> Vec<[f64; 2]> {
    let columns = rows.column(inner).zip(rows.column(outer));
    let both = rows.s.iter().zip(columns).map(|(s, (inner, outer))| {
        let width = (outer.t - inner.t) * sign;
        [100.0 * (s - start), 100.0 * width.max(0.0)]
    });
    profile(&both.collect::<Vec<_>>(), TOLERANCE)
}

/// Returns the start and end of a road's reference line, in metres, or `None` if they are unknown.
pub(crate) fn reach(road: &Road<'_>) -> Option<[f64; 2]> {
    let first = road.plan_view().in_order().next()?.s()?.max(0.0);
    let end = road.plan_view().end()?;
    (first < end).then_some([first, end])
}

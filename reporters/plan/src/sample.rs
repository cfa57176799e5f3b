//! Points on borders, as many as their curves need.

use qcbus_opendrive::geometry::{Curve, Placed};

use crate::frame::{Piece, Rows, Sample};
use crate::origin::{Segment, Shift};

/// How far, in centimetres, borders may lie from the lines between their samples.
pub(crate) const SAMPLED: f64 = 0.3;

/// Where, between its ends, a stretch is looked at. Whatever cubic bends away from the line between the ends is seen
/// at one of two places; and these are nearly where the stretch is farthest from it.
const PROBES: [f64; 2] = [0.3, 0.7];

/// How far, in centimetres, a border may lie at the probes from the line between the ends of a stretch: with the
/// probes as points of the line, a fifth of it remains.
const BENT: f64 = 5.0 * SAMPLED;

/// Stretches of this length, in metres, are not divided.
const SHORTEST: f64 = 1e-3;

/// How far the reference line may turn within a stretch, in radians: else whole circles could hide between probes.
const TURN: f64 = 1.0;

/// At most so many parts are made of a stretch at once.
const PARTS: f64 = 32.0;

/// Rows on a curve that has to be measured for each of its points cost as much as so many borders.
const MEASURED: usize = 40;

/// Why a road cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NotDrawn {
    /// A part of it has no finite place or lies too far away.
    Nowhere,
    /// It has more points than it may have.
    TooLong,
}

/// Takes samples, as long as there is work left that it may do.
pub(crate) struct Sampler {
    pub(crate) origin: Shift,
    /// How many more points may be looked at.
    pub(crate) left: usize,
}

impl Sampler {
    /// Appends the rows of a piece to those of the pieces before. A first row that is no other than the last one is
    /// left out; where something steps, both stay.
    pub(crate) fn take(&mut self, piece: &Piece, rows: &mut Rows) -> Result<(), NotDrawn> {
        let (mut one, mut other, mut end) = (Vec::new(), Vec::new(), Vec::new());
        self.row(piece, piece.from, &mut end)?;
        let same = |(s, row)| f64::abs(s - piece.from) < SHORTEST && is_same(row, &end);
        if !rows.last().is_some_and(same) {
            rows.push(piece.from, &end);
        }
        let parts = turning(piece.placed(), piece.to - piece.from) / TURN;
        // More parts than points allowed need not be listed.
        if parts.is_nan() || parts > self.left as f64 {
            return Err(NotDrawn::TooLong);
        }
        let mut open = Vec::new();
        divide([piece.from, piece.to], parts.ceil().max(1.0), &mut open);
        while let Some(to) = open.pop() {
            self.row(piece, to, &mut end)?;
            if piece.is_straight() {
                rows.push(to, &end);
                continue;
            }
            let Some((from, start)) = rows.last() else {
                break;
            };
            let probes = PROBES.map(|share| from + share * (to - from));
            self.row(piece, probes[0], &mut one)?;
            self.row(piece, probes[1], &mut other)?;
            let bent = bend(start, &one, &end).max(bend(start, &other, &end));
            if bent > BENT && to - from > SHORTEST {
                let parts = (bent / BENT).sqrt().ceil().clamp(2.0, PARTS);
                divide([from, to], parts, &mut open);
                continue;
            }
            if bent > SAMPLED {
                rows.push(probes[0], &one);
                rows.push(probes[1], &other);
            }
            rows.push(to, &end);
        }
        Ok(())
    }

    fn row(&mut self, piece: &Piece, s: f64, row: &mut Vec<Sample>) -> Result<(), NotDrawn> {
        let measured = matches!(piece.placed().curve, Curve::Poly3(_));
        let price = 2 + piece.width() + if measured { MEASURED } else { 0 };
        self.left = self.left.checked_sub(price).ok_or(NotDrawn::TooLong)?;
        piece.row(self.origin, s, row).ok_or(NotDrawn::Nowhere)
    }
}

/// Puts the ends of equal parts of a stretch on the stack, the first one on top.
fn divide([from, to]: [f64; 2], parts: f64, open: &mut Vec<f64>) {
    open.push(to);
    let mut part = parts - 1.0;
    while part >= 1.0 {
        open.push(from + (to - from) * (part / parts));
        part -= 1.0;
    }
}

/// How far a reference line turns at most over a length, in radians.
fn turning(placed: &Placed, length: f64) -> f64 {
    match placed.curve {
        Curve::Line => 0.0,
        Curve::Arc { curvature } => curvature.abs() * length,
        Curve::Spiral(spiral) => {
            let sharpest = spiral
                .start
                .abs()
                .max(spiral.curvature(placed.length).abs());
            sharpest * length
        }
        // Cubics turn about once, whatever their coefficients.
        Curve::ParamPoly3(_) | Curve::Poly3(_) => 2.0 * TURN,
    }
}

/// The largest distance of a row's samples from the lines between those of two others, in centimetres.
fn bend(from: &[Sample], probe: &[Sample], to: &[Sample]) -> f64 {
    let distances = probe.iter().zip(from.iter().zip(to));
    let squares =
        distances.map(|(probe, (from, to))| Segment::between(from.at, to.at).square(probe.at));
    squares.fold(0.0, f64::max).sqrt()
}

/// Whether two rows lie at the same place: nothing steps between them. A tenth of a millimetre is no step.
fn is_same(one: &[Sample], other: &[Sample]) -> bool {
    let mut pairs = one.iter().zip(other);
    pairs.all(|(one, other)| {
        let (x, y) = (one.at.x - other.at.x, one.at.y - other.at.y);
        x.abs() < 0.01 && y.abs() < 0.01
    })
}

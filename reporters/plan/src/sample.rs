//! Sampling of points on borders, as many as their curves need.

use qcbus_opendrive::geometry::{Curve, Placed};

use crate::frame::{Piece, Rows, Sample};
use crate::origin::{Segment, Shift};

/// Maximum distance, in centimetres, of borders from the lines between their samples.
pub(crate) const SAMPLED: f64 = 0.3;

/// Positions within a stretch at which it is probed. For every cubic that deviates from the line
/// between the ends, at least one of the two shows the deviation. They are nearly where the stretch
/// is farthest from the line.
const PROBES: [f64; 2] = [0.3, 0.7];

/// Maximum distance, in centimetres, of a border at the probes from the line between the ends of a
/// stretch. If the probes become points of the line, a fifth of the distance remains.
const BENT: f64 = 5.0 * SAMPLED;

/// Stretches of at most this length, in metres, are not divided.
const SHORTEST: f64 = 1e-3;

/// Maximum turn of the reference line within a stretch, in radians. Otherwise the probes could miss
/// whole circles.
const TURN: f64 = 1.0;

/// Maximum number of parts into which a stretch is divided at once.
const PARTS: f64 = 32.0;

/// Cost of a row on a curve that must be measured for each of its points, in number of borders.
const MEASURED: usize = 40;

/// Reasons why a road cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NotDrawn {
    /// A part of the road has no finite place or is too far away.
    Nowhere,
    /// The road has more points than allowed.
    TooLong,
}

/// Sampler that stops at its work limit.
pub(crate) struct Sampler {
    pub(crate) origin: Shift,
    /// Number of points that may still be computed.
    pub(crate) left: usize,
}

impl Sampler {
    /// Appends the rows of a piece to those of the previous pieces. The first row is left out if it
    /// equals the last one. At a step, both rows stay.
    pub(crate) fn take(&mut self, piece: &Piece, rows: &mut Rows) -> Result<(), NotDrawn> {
        let (mut one, mut other, mut end) = (Vec::new(), Vec::new(), Vec::new());
        self.row(piece, piece.from, &mut end)?;
        let same = |(s, row)| f64::abs(s - piece.from) < SHORTEST && is_same(row, &end);
        if !rows.last().is_some_and(same) {
            rows.push(piece.from, &end);
        }
        let parts = turning(piece.placed(), piece.to - piece.from) / TURN;
        // There are more parts than allowed points, so a list of the parts is not needed.
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

/// Pushes the ends of equal parts of a stretch onto the stack, with the first one on top.
fn divide([from, to]: [f64; 2], parts: f64, open: &mut Vec<f64>) {
    open.push(to);
    let mut part = parts - 1.0;
    while part >= 1.0 {
        open.push(from + (to - from) * (part / parts));
        part -= 1.0;
    }
}

/// Returns the maximum turn of a reference line over a length, in radians.
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
        // A cubic turns only about once, whatever its coefficients are.
        Curve::ParamPoly3(_) | Curve::Poly3(_) => 2.0 * TURN,
    }
}

/// Returns the largest distance of a row's samples from the lines between the samples of two
/// others, in centimetres.
fn bend(from: &[Sample], probe: &[Sample], to: &[Sample]) -> f64 {
    let distances = probe.iter().zip(from.iter().zip(to));
    let squares =
        distances.map(|(probe, (from, to))| Segment::between(from.at, to.at).square(probe.at));
    squares.fold(0.0, f64::max).sqrt()
}

/// Checks whether two rows have the same place, without a step between them. A tenth of a
/// millimetre is not a step.
fn is_same(one: &[Sample], other: &[Sample]) -> bool {
    let mut pairs = one.iter().zip(other);
    pairs.all(|(one, other)| {
        let (x, y) = (one.at.x - other.at.x, one.at.y - other.at.y);
        x.abs() < 0.01 && y.abs() < 0.01
    })
}

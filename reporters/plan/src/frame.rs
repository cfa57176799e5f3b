//! Cross section of a road between two stations at which records begin.

use qcbus_opendrive::geometry::{Cubic, Curve, Placed, Point, Pose};
use qcbus_opendrive::{Profile, Road, Station};

use crate::origin::{Shift, Spot};

/// Maximum distance of a border from the reference line, in metres. A lane beyond it counts as
/// having no width.
const WIDEST: f64 = 10_000.0;

/// Displacement, in metres, at a point where a curve has no direction because the derivative of its
/// parameter is zero.
const NUDGE: f64 = 1e-3;

/// A stretch of road without a change of records, so its borders are smooth.
pub(crate) struct Piece {
    /// Start and end, in metres along the road.
    pub(crate) from: f64,
    pub(crate) to: f64,
    placed: Placed,
    /// Station at which its geometry starts.
    start: f64,
    roll: Option<Cubic>,
    /// Polynomial for t of each border, over the distance from `from`.
    borders: Vec<Cubic>,
}

/// A point on a border.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    pub(crate) at: Spot,
    /// t in metres.
    pub(crate) t: f64,
}

/// The borders at stations along the road, row by row.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    /// Station of each row, in metres along the road.
    pub(crate) s: Vec<f64>,
    /// Number of borders.
    width: usize,
    samples: Vec<Sample>,
}

impl Rows {
    /// Appends a row. All rows have the same borders.
    pub(crate) fn push(&mut self, s: f64, row: &[Sample]) {
        self.width = row.len();
        self.s.push(s);
        self.samples.extend_from_slice(row);
    }

    /// Returns the last row with its station.
    pub(crate) fn last(&self) -> Option<(f64, &[Sample])> {
        let from = self.samples.len().checked_sub(self.width)?;
        Some((*self.s.last()?, self.samples.get(from..)?))
    }

    /// Returns the samples of one border.
    pub(crate) fn column(&self, column: usize) -> impl Iterator<Item = &Sample> {
        let samples = self.samples.get(column..).unwrap_or(&[]);
        samples.iter().step_by(self.width.max(1))
    }
}

impl Piece {
    /// Returns the stretch from `from` to `to` with these borders, or `None` if the reference line
    /// has no place there.
    pub(crate) fn of(road: &Road<'_>, [from, to]: [f64; 2], borders: Vec<Cubic>) -> Option<Piece> {
        let located = road.plan_view().locate(from)?;
        let placed = located.geometry.placed()?;
        let superelevation = &road.lateral().superelevation;
        let roll = (!superelevation.is_empty())
            .then(|| valid(superelevation, from))
            .flatten();
        Some(Piece {
            from,
            to,
            placed,
            start: located.geometry.s()?,
            roll,
            borders,
        })
    }

    /// Returns the shape of the reference line.
    pub(crate) fn placed(&self) -> &Placed {
        &self.placed
    }

    /// Returns the number of borders.
    pub(crate) fn width(&self) -> usize {
        self.borders.len()
    }

    /// Checks whether all borders are straight lines.
    pub(crate) fn is_straight(&self) -> bool {
        let linear = |cubic: &Cubic| cubic.c == 0.0 && cubic.d == 0.0;
        self.placed.curve == Curve::Line && self.roll.is_none() && self.borders.iter().all(linear)
    }

    /// Writes the cross section at `s` into `row`. Returns `None` if it has no place on the plan.
    pub(crate) fn row(&self, origin: Shift, s: f64, row: &mut Vec<Sample>) -> Option<()> {
        let pose = self.pose((s - self.start).max(0.0))?;
        let ds = s - self.from;
        // The superelevation rotates the t direction (8.3).
        let roll = self.roll.and_then(|roll| roll.eval(ds));
        let tilt = roll.map_or(1.0, f64::cos);
        let (sin, cos) = pose.hdg.sin_cos();
        let mut last = 0.0;
        row.clear();
        for border in &self.borders {
            let t = border.value(ds);
            // This comparison also excludes NaN.
            let t = if t.abs() <= WIDEST { t } else { last };
            let lateral = t * tilt;
            let point = Point {
                x: pose.x - sin * lateral,
                y: pose.y + cos * lateral,
            };
            let at = origin.spot(point)?;
            row.push(Sample { at, t });
            last = t;
        }
        Some(())
    }

    fn pose(&self, ds: f64) -> Option<Pose> {
        let placed = &self.placed;
        placed.pose(ds).or_else(|| {
            let turned = placed
                .pose(ds + NUDGE)
                .or_else(|| placed.pose(ds - NUDGE))?;
            let point = placed.point(ds)?;
            Some(Pose {
                x: point.x,
                y: point.y,
                ..turned
            })
        })
    }
}

/// Returns the polynomial of a profile that is valid at a place, shifted to that place.
pub(crate) fn valid(profile: &Profile<'_>, at: impl Into<Station>) -> Option<Cubic> {
    let valid = profile.valid_at(at)?;
    Some(valid.cubic.shifted(valid.ds))
}

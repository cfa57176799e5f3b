//! Severity of gaps, steps and kinks, by size and version. The table is in `docs/gaps.md`.
//!
//! Every rule about a gap, a step or a kink reports above its own tolerance. Values below
//! `…_error_from` are warnings, because simulators tolerate them. From there on they are errors
//! where the standard requires that things meet. In files of older versions the level is one lower.
//! A lane that continues metres beside its end, or half a metre above it, cannot be driven on. This
//! is an error in every version.

use crate::prelude::*;

/// Limits for gaps in the plan view.
pub(crate) const GAP_ERROR_FROM: Param = Param::number(
    "gap_error_from",
    0.1,
    "m",
    "minimum size of gaps that are errors where the standard allows none",
);
pub(crate) const GAP_BROKEN_FROM: Param = Param::number(
    "gap_broken_from",
    1.0,
    "m",
    "minimum distance at which two things do not meet at all, which is an error in every version",
);

/// Limits for steps in height.
pub(crate) const STEP_ERROR_FROM: Param = Param::number(
    "step_error_from",
    0.1,
    "m",
    "minimum height of steps that are errors where the standard allows none",
);
pub(crate) const STEP_BROKEN_FROM: Param = Param::number(
    "step_broken_from",
    0.3,
    "m",
    "minimum height of steps that are errors in every version, the radius of a wheel of a car",
);

/// Limits for changes of direction, in plan view and crossfall. The second one applies to reference
/// lines and to the ends of roads.
pub(crate) const KINK_ERROR_FROM: Param = Param::number(
    "kink_error_from",
    0.2,
    "rad",
    "minimum angle of kinks that are errors where the standard allows none",
);
pub(crate) const KINK_BROKEN_FROM: Param = Param::number(
    "kink_broken_from",
    0.785,
    "rad",
    "minimum angle of kinks that are errors in every version, the largest steering angle of a car",
);

/// Severity of a misfit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Misfit {
    /// Above the tolerance, but harmless.
    Slight,
    /// An error where the standard requires a continuous transition.
    Plain,
    /// An error in every version.
    Broken,
}

impl Misfit {
    /// Classifies a gap in the plan view. `widest` is the largest gap. `whole` is the distance
    /// between the two things as a whole, because the largest gap may affect only a corner.
    pub fn gap(widest: f64, whole: f64, found: &Sink<'_>) -> Misfit {
        let from = [&GAP_ERROR_FROM, &GAP_BROKEN_FROM].map(|param| found.number(param));
        Misfit::of(widest, whole, from)
    }

    /// Classifies a step in height.
    pub fn step(height: f64, found: &Sink<'_>) -> Misfit {
        let from = [&STEP_ERROR_FROM, &STEP_BROKEN_FROM].map(|param| found.number(param));
        Misfit::of(height, height, from)
    }

    /// Classifies a kink between two lanes. Older versions allow any angle, because the lanes have a
    /// gap as well if the roads do not continue each other.
    pub fn kink(angle: f64, found: &Sink<'_>) -> Misfit {
        let from = [found.number(&KINK_ERROR_FROM), f64::INFINITY];
        Misfit::of(angle, angle, from)
    }

    fn of(size: f64, whole: f64, [error_from, broken_from]: [f64; 2]) -> Misfit {
        if whole >= broken_from {
            Misfit::Broken
        } else if size >= error_from {
            Misfit::Plain
        } else {
            Misfit::Slight
        }
    }

    /// Sets the level of a finding according to the misfit.
    pub fn put<'s, 'd>(self, finding: Finding<'s, 'd>) -> Finding<'s, 'd> {
        match self {
            Misfit::Broken => finding.in_every_version(Level::Error),
            Misfit::Plain => finding.level(Level::Error),
            Misfit::Slight => finding.level(Level::Warning),
        }
    }
}

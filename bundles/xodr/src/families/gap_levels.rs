//! How bad it is that two things do not meet, from what is missing and the version. The table is in
//! `docs/gaps.md`.
//!
//! Every rule about a gap, a step or a kink says something from its own tolerance on. What is above that
//! and below `…_error_from` is a warning: no simulator minds. From there on it is an error where the
//! standard demands that things meet, and one less in files of older versions. What nobody can drive over
//! as it is written, a lane that goes on metres beside itself, is an error in every version.

use qcbus_sdk::{Finding, Level, Param, Sink};

/// Gaps in the plan view.
pub(crate) const GAP_ERROR_FROM: Param = Param::number(
    "gap_error_from",
    0.1,
    "m",
    "gaps from this size on are errors where the standard demands that there are none",
);
pub(crate) const GAP_BROKEN_FROM: Param = Param::number(
    "gap_broken_from",
    1.0,
    "m",
    "from this distance on, what should meet does not at all, which is an error in every version",
);

/// Steps in height.
pub(crate) const STEP_ERROR_FROM: Param = Param::number(
    "step_error_from",
    0.1,
    "m",
    "steps from this height on are errors where the standard demands that there are none",
);
pub(crate) const STEP_BROKEN_FROM: Param = Param::number(
    "step_broken_from",
    3.0,
    "m",
    "steps from this height on are errors in every version",
);

/// Changes of direction, in plan view and crossfall.
pub(crate) const KINK_ERROR_FROM: Param = Param::number(
    "kink_error_from",
    0.2,
    "rad",
    "kinks from this angle on are errors where the standard demands that there are none",
);

/// How bad a misfit is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Misfit {
    /// More than the tolerance, and less than anybody minds.
    Slight,
    /// An error where the standard demands that there is none.
    Plain,
    /// An error in every version.
    Broken,
}

impl Misfit {
    /// A gap in the plan view. `widest` is the worst that is there; `whole` is how far apart the two things
    /// lie as a whole, when the worst may be no more than a corner of it.
    pub fn gap(widest: f64, whole: f64, found: &Sink<'_>) -> Misfit {
        let from = [&GAP_ERROR_FROM, &GAP_BROKEN_FROM].map(|param| found.number(param));
        Misfit::of(widest, whole, from)
    }

    /// A step in height.
    pub fn step(height: f64, found: &Sink<'_>) -> Misfit {
        let from = [&STEP_ERROR_FROM, &STEP_BROKEN_FROM].map(|param| found.number(param));
        Misfit::of(height, height, from)
    }

    /// A kink. It can be driven somehow: no angle is an error in versions that allow it.
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

    /// Gives a finding the level that is due.
    pub fn put<'s, 'd>(self, finding: Finding<'s, 'd>) -> Finding<'s, 'd> {
        match self {
            Misfit::Broken => finding.in_every_version(Level::Error),
            Misfit::Plain => finding.level(Level::Error),
            Misfit::Slight => finding.level(Level::Warning),
        }
    }
}

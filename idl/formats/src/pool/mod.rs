//! Pooling: merges the findings of bundles into one result, according to a configuration.
//!
//! The broker pools the bundles of a job ([`Scope::Whole`]). A bundle that runs by itself as an
//! ASAM module pools its own findings ([`Scope::Alone`]). Removed issues are counted and reported,
//! and so are missing checkers. The same input gives the same result, byte for byte.

mod absent;
mod asked;
mod assemble;
mod cause;
mod outcome;
mod places;
mod remarks;
mod uid;

use crate::config::Config;
use crate::xqar::{Issue, Results};
use crate::{Text, Verdict};

pub use asked::NotAsked;
pub use cause::{ALSO, ALSO_HERE, CAUSE_INFO, Cause, RULE_INFO, rule_info};
pub use outcome::{
    Asked, BundleOutcome, CheckerOutcome, Ending, in_the_answer, state_levels_of_asam,
};
pub use places::{NoPlaces, Resolver, XPathPlace};
pub use remarks::chosen;
pub use uid::{RuleUids, is_rule_uid};

/// Name of the bundle for qcbus's own remarks.
pub const OWN_BUNDLE: &str = "qcbus";

/// Metadata key of a checker: the number of its findings that are not listed.
pub const NOT_LISTED: &str = "qcbus.not_listed";

/// Checker of [`OWN_BUNDLE`] that reports which checkers the command line left out.
pub const CHOICE_CHECKER: &str = "qcbus_choice";

/// Metadata key of a blocked checker. ASAM's format calls it `skipped`, like a checker that does
/// not apply.
pub const BLOCKED: &str = "qcbus.blockedBy";

/// Input of pooling.
#[derive(Debug)]
pub struct PoolInput<'a> {
    /// Absolute path of the checked file. It becomes the parameter `InputFile` of every bundle.
    pub input_file: &'a str,
    /// The configuration in force, if there is one.
    pub config: Option<&'a Config>,
    /// The findings of each bundle, in the order of the result without a configuration.
    pub bundles: Vec<BundleOutcome>,
    /// qcbus's own remarks about this check.
    pub remarks: Vec<Remark>,
    /// Whether configured bundles that are not among [`Self::bundles`] are missing.
    pub scope: Scope,
    /// Whether findings about one fault stay separate issues.
    pub separate: bool,
    /// Version of the caller's program, written for the bundle `qcbus`.
    pub version: &'a str,
    /// Date of the caller's build, `YYYY-MM-DD`.
    pub build_date: &'a str,
}

/// Whether the outcomes are complete.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// All configured bundles must be present; a missing one becomes `error`.
    Whole,
    /// A single bundle: other bundles in the configuration are ignored.
    Alone,
}

/// A remark by qcbus itself, in the bundle `qcbus`. It is never filtered.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// The checker that lists it, such as `qcbus_limits`.
    pub checker: String,
    /// Subject of that checker, in a sentence.
    pub description: String,
    /// The issue. Its `rule_uid` becomes an addressed rule of that checker.
    pub issue: Option<Issue>,
    /// The reason why the file cannot be accepted, if there is one.
    pub open: Option<String>,
}

/// A pooled result and the data for its verdict.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pooled {
    /// The result, ready to be written.
    pub results: Results,
    /// The issues kept, by level.
    pub counts: Counts,
    /// The issues removed, by their level after configuration.
    pub removed: Counts,
    /// The checkers that did not complete, in the order of the result.
    pub unfinished: Vec<Unfinished>,
}

impl Pooled {
    /// Returns the verdict.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.results)
    }

    /// Returns the verdict without the findings of one checker.
    pub fn verdict_without(&self, checker: &str) -> Verdict {
        Verdict::without(&self.results, checker)
    }

    /// Returns the checkers that prevent acceptance although no error was found.
    pub fn open(&self) -> impl Iterator<Item = &Unfinished> {
        self.unfinished.iter().filter(|it| it.ending.is_open())
    }
}

/// Numbers of issues by level.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Number of errors.
    pub errors: u64,
    /// Number of warnings.
    pub warnings: u64,
    /// Number of issues of level information.
    pub information: u64,
}

/// A checker that did not complete.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Unfinished {
    /// Name of its bundle.
    pub bundle: String,
    /// Its identifier.
    pub checker: Text,
    /// How it ended.
    pub ending: Ending,
}

impl std::fmt::Display for Unfinished {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "{} / {}: {}",
            self.bundle,
            self.checker,
            self.ending.reason()
        )
    }
}

/// Pools the findings of bundles into one result. `resolver` completes the places.
///
/// Bundles and checkers are in configured order, or in the given order without a configuration. The
/// bundle `qcbus` comes last and only if it has remarks.
pub fn pool(input: PoolInput<'_>, resolver: &mut dyn Resolver) -> Pooled {
    assemble::pool(input, resolver)
}

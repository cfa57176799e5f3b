//! Pooling: what bundles found, under a configuration, becomes one result.
//!
//! The broker pools the bundles of a job ([`Scope::Whole`]); a bundle that is run by itself as an
//! ASAM module pools its own findings ([`Scope::Alone`]). What is removed is counted and told,
//! what is missing is told, and the same input gives the same result, byte for byte.

mod absent;
mod asked;
mod assemble;
mod outcome;
mod places;
mod remarks;
mod uid;

use crate::config::Config;
use crate::xqar::{Issue, Results};
use crate::{Text, Verdict};

pub use asked::NotAsked;
pub use outcome::{Asked, BundleOutcome, CheckerOutcome, Ending, in_the_answer};
pub use places::{NoPlaces, Resolver, XPathPlace};
pub use remarks::chosen;
pub use uid::{RuleUids, is_rule_uid};

/// The name of the bundle in which qcbus speaks for itself.
pub const OWN_BUNDLE: &str = "qcbus";

/// Key of a checker's metadata: how many findings it has besides those that it lists.
pub const NOT_LISTED: &str = "qcbus.not_listed";

/// The checker of [`OWN_BUNDLE`] that says what the command line left out.
pub const CHOICE_CHECKER: &str = "qcbus_choice";

/// Name of the information on an issue that names a further rule which the same fact breaks: the format
/// has room for one only.
pub const RULE_INFO: &str = "qcbus.rule";

/// Key of the metadata of a checker that could not look, which ASAM's format calls `skipped` like
/// one that does not apply.
pub const BLOCKED: &str = "qcbus.blockedBy";

/// What is to be pooled.
#[derive(Debug)]
pub struct PoolInput<'a> {
    /// Absolute path of the checked file; becomes the parameter `InputFile` of every bundle.
    pub input_file: &'a str,
    /// The configuration in force, if there is one.
    pub config: Option<&'a Config>,
    /// What each bundle found, in the order of the result when no configuration says otherwise.
    pub bundles: Vec<BundleOutcome>,
    /// What qcbus itself has to say about this check.
    pub remarks: Vec<Remark>,
    /// Whether configured bundles that are not among [`Self::bundles`] are missing.
    pub scope: Scope,
    /// Version and build date written for the bundle `qcbus`: of the caller's own program.
    pub version: &'a str,
    /// Date of the caller's build, `YYYY-MM-DD`.
    pub build_date: &'a str,
}

/// Whether the outcomes are all that there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Everything that the configuration demands should be there; what is not becomes `error`.
    Whole,
    /// One bundle by itself: the configuration's other bundles are nobody's business.
    Alone,
}

/// Something that qcbus says itself, in the bundle `qcbus`, never filtered.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// The checker under which it is listed, such as `qcbus_limits`.
    pub checker: String,
    /// What that checker looks at, in a sentence.
    pub description: String,
    /// The issue: its `rule_uid` becomes an addressed rule of that checker.
    pub issue: Option<Issue>,
    /// Why nothing may be accepted as long as this is so.
    pub open: Option<String>,
}

/// A pooled result and what a verdict needs to know about it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pooled {
    /// The result, ready to be written.
    pub results: Results,
    /// The issues kept, by level.
    pub counts: Counts,
    /// The issues removed, by level as they would have been kept.
    pub removed: Counts,
    /// The checkers that did not complete, in the order of the result.
    pub unfinished: Vec<Unfinished>,
}

impl Pooled {
    /// The verdict.
    pub fn verdict(&self) -> Verdict {
        Verdict::of(&self.results)
    }

    /// The verdict without what one checker says.
    pub fn verdict_without(&self, checker: &str) -> Verdict {
        Verdict::without(&self.results, checker)
    }

    /// What keeps the file from being accepted though no error was found.
    pub fn open(&self) -> impl Iterator<Item = &Unfinished> {
        self.unfinished.iter().filter(|it| it.ending.is_open())
    }
}

/// Numbers of issues.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Of level error.
    pub errors: u64,
    /// Of level warning.
    pub warnings: u64,
    /// Of level information.
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

/// Pools what bundles found into one result. Places are completed with `resolver`.
///
/// Order: bundles and checkers as configured, without a configuration as given; the bundle
/// `qcbus` comes last and only when it has something to say.
pub fn pool(input: PoolInput<'_>, resolver: &mut dyn Resolver) -> Pooled {
    assemble::pool(input, resolver)
}

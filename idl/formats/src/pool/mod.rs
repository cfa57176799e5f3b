//! Pooling: what bundles found, under a configuration, becomes one result.
//!
//! The broker pools the bundles of a job ([`Scope::Whole`]); a bundle that is run by itself as an
//! ASAM module pools its own findings ([`Scope::Alone`]). What is removed is counted and told,
//! what is missing is told, and the same input gives the same result, byte for byte.

mod absent;
mod assemble;
mod places;
mod remarks;
mod uid;

use crate::config::Config;
use crate::xqar::{Issue, Metadata, Param, Results, Status};

pub use places::{NoPlaces, Resolver, XPathPlace};
pub use uid::is_rule_uid;

/// The name of the bundle in which qcbus speaks for itself.
pub const OWN_BUNDLE: &str = "qcbus";

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

/// What one bundle found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BundleOutcome {
    /// Its name, such as `xodrBundle`.
    pub name: String,
    /// Its short name, such as `xodr`; a configuration may use it for the name.
    pub alias: String,
    /// Its version.
    pub version: String,
    /// Date of its build, `YYYY-MM-DD`.
    pub build_date: String,
    /// What it checks.
    pub description: String,
    /// Parameters of the bundle beyond the configured ones.
    pub params: Vec<Param>,
    /// Its checkers in the order of its catalogue: those that were demanded, and any others for
    /// which it sent something.
    pub checkers: Vec<CheckerOutcome>,
}

/// What one checker found.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct CheckerOutcome {
    /// Its identifier.
    pub id: String,
    /// What it checks.
    pub description: String,
    /// The rules that it answers for.
    pub rule_uids: Vec<String>,
    /// How it ended; `None`: it never said, which becomes `error`.
    pub status: Option<Status>,
    /// Why it was skipped or failed; empty when completed.
    pub reason: String,
    /// The parameters that it used.
    pub params: Vec<Param>,
    /// Its findings, ids not yet given.
    pub issues: Vec<Issue>,
    /// Further facts.
    pub metadata: Vec<Metadata>,
}

/// Something that qcbus says itself; becomes an issue of the bundle `qcbus`, never filtered.
#[derive(Debug, Clone, PartialEq)]
pub struct Remark {
    /// The checker under which it is listed, such as `qcbus_limits`.
    pub checker: String,
    /// What that checker looks at, in a sentence.
    pub description: String,
    /// The issue: its `rule_uid` becomes an addressed rule of that checker.
    pub issue: Issue,
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
    /// The demanded checkers that ended with status error, in the order of the result.
    pub failed: Vec<FailedChecker>,
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

/// A demanded checker that did not do its work.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FailedChecker {
    /// Name of its bundle.
    pub bundle: String,
    /// Its identifier.
    pub checker: String,
    /// Why.
    pub reason: String,
}

/// Pools what bundles found into one result. Places are completed with `resolver`.
///
/// Order: bundles and checkers as configured, without a configuration as given; the bundle
/// `qcbus` comes last and only when it has something to say.
pub fn pool(input: PoolInput<'_>, resolver: &mut dyn Resolver) -> Pooled {
    assemble::pool(input, resolver)
}

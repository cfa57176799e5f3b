//! Parts of a checker bundle, and ways to run it.
//!
//! A bundle is a list of [`Rule`]s. A rule is data and one function that examines a [`Model`] of a
//! document and reports findings to a [`Sink`]. The same bundle runs on the bus, on a single file,
//! and as a module of ASAM's framework; see [`run()`]. `docs/writing-a-rule.md` shows the way from
//! nothing to a tested rule.

pub mod basic;
mod bundle;
mod cached;
mod check;
mod load;
pub mod pages;
mod param;
mod permits;
mod place;
mod plan;
mod resource;
mod rule;
pub mod run;
mod seen;
mod sink;
mod subject;
mod version;

pub use bundle::{BACKPORT_SUFFIX, Bundle, Checker, Reads};
pub use cached::LinkedModel;
pub use check::{Listener, Outcome, check, check_with};
pub use load::{LoadError, Loaded};
pub use param::{Default, LEVELS, MAX_ISSUES, Param, ParamError, Values};
pub use permits::Permits;
pub use place::Place;
pub use plan::Plan;
pub use qcbus_formats::xqar::{Issue, Level, Status};
pub use qcbus_ingest::modular;
pub use qcbus_messages::BUILD_DATE;
pub use resource::{Resource, ResourceError, ResourceFile, ResourceValue, UserFiles};
#[doc(hidden)]
pub use rule::Built;
pub use rule::{AnyRule, Backport, Each, Facts, Model, Readers, Rule, Unbuilt};
pub use run::{Exit, Mode, Timings, examine, examine_timed, findings, main, run};
pub use sink::{Finding, Sink, UNKNOWN_VERSION, fault_of, fault_of_attribute};
pub use subject::{Linked, Subject};
pub use version::{Version, VersionError, VersionRange};

//! SDK for reporters: defines the trait to implement and provides the code around it.
//!
//! A reporter is a value with one method, [`Reporter::report`], that writes one result. [`run`]
//! runs it on the bus as a daemon: it joins and acknowledges each result after it was written. It
//! survives the loss of the broker and stops when it is drained. [`report_once`] runs the same
//! reporter on an existing `.xqar`, as ASAM's report modules do.
//!
//! The crate also has the common parts of reporters: the lines of the checked files ([`Sources`]),
//! the places of an issue with those in other files ([`issue_locations`]), and the targets of
//! reports ([`OutputTarget`], [`Output`], [`ArtifactStore`]). A reporter that converts results to
//! text implements only [`ReportFormat`]. A crate describes its reporter in a [`Registration`].

mod artifacts;
mod checkers;
mod clean;
mod daemon;
mod fingerprint;
mod format;
mod gathered;
mod issue_location;
mod loaded;
mod once;
mod output;
mod output_target;
mod registration;
mod responder;
mod road_network;
mod silence;
mod sources;
mod underline;
mod wording;

pub use artifacts::ArtifactStore;
pub use checkers::{checkers, is_blocked, is_inapplicable, is_open, not_listed, reason};
pub use clean::{one_line, printable};
pub use daemon::{Identity, RunError, run};
pub use fingerprint::{Repeats, fingerprint, fingerprint_of};
pub use format::{Destination, FormatReporter, ReportFormat};
pub use gathered::{Gathered, GatheredFile};
pub use issue_location::{IssueLocation, issue_locations, path_for_people};
pub use loaded::{LoadError, load};
pub use once::{OnceError, OneShot, report_once};
pub use output::{
    Output, clear_place, earlier, inside, param, remove_file, replace_file, write_named,
};
pub use output_target::{OutputTarget, Subject, write_stream};
pub use registration::{Pages, Registration, RulePage, Setting};
pub use responder::Responder;
pub use road_network::road_network;
pub use silence::{Silence, silences};
pub use sources::{Answer, BothSources, FileSources, ImageSources, Line, NoSources, Sources};
pub use underline::underlined;
pub use wording::{meaning, rounded, rule_name};

use std::path::PathBuf;

use qcbus_messages::path_text::to_text;
use qcbus_messages::{ResultMessage, Withdrawn};

/// A writer of results.
///
/// Writing is idempotent: the same result may come again after a crash. A newer result of a file
/// replaces the older one.
pub trait Reporter: Send {
    /// Writes one result. When this returns `Ok`, the report is at its target.
    ///
    /// # Errors
    /// [`ReportError`] when it could not be written. The broker receives the error, and the next
    /// broker tries again.
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError>;

    /// Removes the report about a file that no longer exists. The report may be missing.
    ///
    /// # Errors
    /// [`ReportError`] when it could not be removed. The broker is informed and does not try again.
    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError>;

    /// Brings the collected data into its final order after all results.
    ///
    /// # Errors
    /// [`ReportError`] when that could not be written.
    fn finish(&mut self) -> Result<(), ReportError> {
        Ok(())
    }
}

/// Reasons why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system or the stream returned an error.
    #[error("write {}: {source}", to_text(path))]
    Write {
        /// Path of the file, or `__stdout__` and `__stderr__`.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A parameter of the configuration is invalid.
    #[error("use the parameter {name}=\"{value}\": {why}")]
    Param {
        /// Name of the parameter.
        name: String,
        /// Value of the parameter.
        value: String,
        /// Allowed values.
        why: String,
    },
    /// The result cannot be converted to the report's format.
    #[error("convert the result to the format of the report: {0}")]
    Form(String),
}

//! How a reporter runs: what it implements, and everything around it.
//!
//! A reporter is a value with one method, [`Reporter::report`], that writes one result. [`run`]
//! puts it on the bus as a daemon: it joins, acknowledges each result after it was written, lives
//! through the loss of the broker, and goes when it is drained. [`report_once`] runs the same
//! reporter on an `.xqar` that exists already, as ASAM's report modules do.
//!
//! What reporters have in common lies here too: the lines of the checked files ([`Sources`]), the
//! places of an issue with those in other files ([`issue_locations`]), and where reports go ([`OutputTarget`],
//! [`Output`], [`ArtifactStore`]). A reporter that turns results into text implements [`ReportFormat`] and nothing
//! else; a crate says by a [`Registration`] what it offers.

mod artifacts;
mod checkers;
mod clean;
mod daemon;
mod fingerprint;
mod format;
mod issue_location;
mod loaded;
mod once;
mod output;
mod output_target;
mod registration;
mod responder;
mod road_network;
pub mod samples;
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

/// Something that writes results.
///
/// Writing is idempotent: the same result may be given again after a crash, and the newer result
/// of a file takes the place of the older one.
pub trait Reporter: Send {
    /// Writes one result. When this returns `Ok`, the report is where it belongs.
    ///
    /// # Errors
    /// [`ReportError`] when it could not be written; it is told to the broker, and tried
    /// again by the next one.
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError>;

    /// A file has gone: takes back what was reported about it. Nothing may be there to take back.
    ///
    /// # Errors
    /// [`ReportError`] when it could not be taken back; it is told to the broker and not tried
    /// again.
    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError>;

    /// All results have been given; brings what was collected into its final order.
    ///
    /// # Errors
    /// [`ReportError`] when that could not be written.
    fn finish(&mut self) -> Result<(), ReportError> {
        Ok(())
    }
}

/// Why a report could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// The file system or the stream refused.
    #[error("write {}: {source}", to_text(path))]
    Write {
        /// The file, or `__stdout__` and `__stderr__`.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A parameter of the configuration makes no sense.
    #[error("use the parameter {name}=\"{value}\": {why}")]
    Param {
        /// Its name.
        name: String,
        /// Its value.
        value: String,
        /// What is allowed.
        why: String,
    },
    /// The result cannot be put in the report's form.
    #[error("put the result in its form: {0}")]
    Form(String),
}

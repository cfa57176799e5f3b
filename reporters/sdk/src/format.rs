//! A form in which results are written.

use std::collections::BTreeMap;

use qcbus_messages::{ResultMessage, Withdrawn};

use crate::{OutputTarget, ReportError, Reporter, Setting, Sources, Subject};

/// A form of reports, such as SARIF: how results become text. Pure; where the text goes is the
/// [`OutputTarget`]'s affair.
///
/// What one result gives is a *section*. A report is made of one section or of those of many files.
pub trait ReportFormat: Send {
    /// What one result gives.
    type Section: PartialEq + Send;

    /// What the names of reports in files of their own end with, without a dot.
    const SUFFIX: &'static str;

    /// Under what the section of a checked file is found again by [`ReportFormat::split`].
    fn key(&self, subject: Subject<'_>) -> String {
        subject.input.to_owned()
    }

    /// What a result gives.
    ///
    /// # Errors
    /// [`ReportError`], mostly for parameters that make no sense.
    fn section(
        &self,
        result: &ResultMessage,
        sources: &dyn Sources,
        place: Destination,
    ) -> Result<Self::Section, ReportError>;

    /// A whole report of these sections, in the order of their keys: also of none.
    ///
    /// # Errors
    /// [`ReportError::Form`].
    fn whole(&self, sections: &BTreeMap<String, Self::Section>) -> Result<String, ReportError>;

    /// A report of one section in a file of its own or on a stream.
    ///
    /// # Errors
    /// [`ReportError::Form`].
    fn alone(&self, key: String, section: Self::Section) -> Result<String, ReportError> {
        self.whole(&BTreeMap::from([(key, section)]))
    }

    /// The sections of a report that was written earlier, by their keys. What is not of this form is
    /// dropped.
    fn split(&self, text: &str) -> BTreeMap<String, Self::Section>;

    /// How a section is put at the end of a report of many; `None` when such a report is one
    /// document, which has to be written anew.
    fn appended(&self, key: &str, section: &Self::Section) -> Option<String> {
        let _ = (key, section);
        None
    }
}

/// For what a section is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Destination {
    /// A stream that somebody may look at, and whether to colour.
    Stream {
        /// Whether to colour.
        color: bool,
    },
    /// A file of its own.
    OwnFile,
    /// A file for the reports of all files.
    SharedFile,
}

/// The reporter of a form.
pub struct FormatReporter<F: ReportFormat> {
    output_target: OutputTarget<F>,
    color: bool,
}

impl<F: ReportFormat> FormatReporter<F> {
    /// A reporter that has written nothing yet.
    pub fn new(format: F, setting: &Setting) -> FormatReporter<F> {
        FormatReporter {
            output_target: OutputTarget::new(format, setting),
            color: setting.color,
        }
    }
}

impl<F: ReportFormat> Reporter for FormatReporter<F> {
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError> {
        self.output_target.put(result, sources, self.color)
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        self.output_target.withdraw(Subject::from(gone))
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.output_target.finish()
    }
}

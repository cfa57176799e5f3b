//! A format for results.

use std::collections::BTreeMap;

use qcbus_messages::{ResultMessage, Withdrawn};

use crate::{OutputTarget, ReportError, Reporter, Setting, Sources, Subject};

/// A format of reports, such as SARIF: converts results to text. It has no side effects; the
/// [`OutputTarget`] decides the target of the text.
///
/// The part of one result is a *section*. A report has one section or the sections of many files.
pub trait ReportFormat: Send {
    /// Part of one result in a report.
    type Section: PartialEq + Send;

    /// Suffix, without a dot, of reports in separate files.
    const SUFFIX: &'static str;

    /// Returns the key under which [`ReportFormat::split`] finds the section of a checked file
    /// again.
    fn key(&self, subject: Subject<'_>) -> String {
        subject.input.to_owned()
    }

    /// Returns the section of a result.
    ///
    /// # Errors
    /// [`ReportError`], mostly for invalid parameters.
    fn section(
        &self,
        result: &ResultMessage,
        sources: &dyn Sources,
        place: Destination,
    ) -> Result<Self::Section, ReportError>;

    /// Returns a whole report of these sections, in the order of their keys. There may be no
    /// sections.
    ///
    /// # Errors
    /// [`ReportError::Form`].
    fn whole(&self, sections: &BTreeMap<String, Self::Section>) -> Result<String, ReportError>;

    /// Returns a report of one section for a separate file or a stream.
    ///
    /// # Errors
    /// [`ReportError::Form`].
    fn alone(&self, key: String, section: Self::Section) -> Result<String, ReportError> {
        self.whole(&BTreeMap::from([(key, section)]))
    }

    /// Returns the sections of a report that was written earlier, by their keys. Content of another
    /// format is dropped.
    fn split(&self, text: &str) -> BTreeMap<String, Self::Section>;

    /// Returns the text that appends a section to a report of many. Returns `None` if such a report
    /// is one document, which must be rewritten.
    fn appended(&self, key: &str, section: &Self::Section) -> Option<String> {
        let _ = (key, section);
        None
    }
}

/// Target of a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Destination {
    /// A stream that may be a terminal.
    Stream {
        /// Whether to use colour.
        color: bool,
    },
    /// A separate file.
    OwnFile,
    /// A shared file for the reports of all files.
    SharedFile,
}

/// Reporter for a format.
pub struct FormatReporter<F: ReportFormat> {
    output_target: OutputTarget<F>,
    color: bool,
}

impl<F: ReportFormat> FormatReporter<F> {
    /// Creates a reporter that has not written anything.
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

//! Writes a rendered report to its target.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Param;
use qcbus_messages::{ResultMessage, Withdrawn};

use crate::output::remove_file;
use crate::{
    ArtifactStore, Destination, Output, ReportError, ReportFormat, Setting, Sources, replace_file,
};

/// The file of a report, with the parameters of the reporter.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'m> {
    /// Absolute path of the file.
    pub input: &'m str,
    /// Display path of the file.
    pub display_path: &'m str,
    /// Absolute path of its `.xqar`.
    pub xqar: &'m str,
    /// Parameters from the configuration.
    pub params: &'m [Param],
}

impl<'m> From<&'m ResultMessage> for Subject<'m> {
    fn from(result: &'m ResultMessage) -> Subject<'m> {
        Subject {
            input: &result.input,
            display_path: &result.display_path,
            xqar: &result.xqar,
            params: &result.params,
        }
    }
}

impl<'m> From<&'m Withdrawn> for Subject<'m> {
    fn from(gone: &'m Withdrawn) -> Subject<'m> {
        Subject {
            input: &gone.input,
            display_path: &gone.display_path,
            xqar: &gone.xqar,
            params: &gone.params,
        }
    }
}

/// Writer of reports to the target given by the parameter `OutputFile`; it also removes them.
pub struct OutputTarget<F: ReportFormat> {
    format: F,
    keep: bool,
    is_run: bool,
    artifact_stores: BTreeMap<PathBuf, ArtifactStore<F>>,
    /// Sections to print at the end of the run, by stream.
    waiting: BTreeMap<Output, BTreeMap<String, F::Section>>,
}

impl<F: ReportFormat> OutputTarget<F> {
    /// Creates an output target for reports of one format.
    pub fn new(format: F, setting: &Setting) -> OutputTarget<F> {
        OutputTarget {
            format,
            keep: setting.keep,
            is_run: setting.is_run,
            artifact_stores: BTreeMap::new(),
            waiting: BTreeMap::new(),
        }
    }

    /// Writes the report of a result. When this returns `Ok`, the report is at its target. In a
    /// run, shared reports of all files are written by [`OutputTarget::finish`].
    ///
    /// # Errors
    /// [`ReportError`].
    pub fn put(
        &mut self,
        result: &ResultMessage,
        sources: &dyn Sources,
        color: bool,
    ) -> Result<(), ReportError> {
        let subject = Subject::from(result);
        let output = Output::of(subject.params);
        let place = match output {
            Output::Stdout | Output::Stderr => Destination::Stream { color },
            Output::File(_) => Destination::SharedFile,
            Output::BesideResult | Output::Directory(_) => Destination::OwnFile,
        };
        let key = self.format.key(subject);
        let section = self.format.section(result, sources, place)?;
        match &output {
            Output::Stdout | Output::Stderr => self.stream(output, key, section),
            Output::File(path) => {
                self.open(path)?;
                let artifacts = self.artifact_stores.get_mut(path);
                artifacts.map_or(Ok(()), |artifacts| {
                    artifacts.put(&self.format, &key, section)
                })
            }
            Output::BesideResult | Output::Directory(_) => {
                match output.own_file(subject, F::SUFFIX) {
                    Some(path) => replace_file(&path, self.format.alone(key, section)?.as_bytes()),
                    None => Ok(()),
                }
            }
        }
    }

    /// Removes the report of a file that no longer exists. Output on a stream stays there.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn withdraw(&mut self, subject: Subject<'_>) -> Result<(), ReportError> {
        let output = Output::of(subject.params);
        match &output {
            Output::Stdout | Output::Stderr => Ok(()),
            Output::File(path) => {
                let key = self.format.key(subject);
                self.open(path)?;
                let artifacts = self.artifact_stores.get_mut(path);
                artifacts.map_or(Ok(()), |artifacts| artifacts.withdraw(&self.format, &key))
            }
            Output::BesideResult | Output::Directory(_) => {
                match output.own_file(subject, F::SUFFIX) {
                    Some(path) => remove_file(&path),
                    None => Ok(()),
                }
            }
        }
    }

    /// Sorts the sections of shared files by path, and writes everything that was delayed until the
    /// end of the run.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn finish(&mut self) -> Result<(), ReportError> {
        let mut artifact_stores = self.artifact_stores.values_mut();
        artifact_stores.try_for_each(|artifacts| artifacts.finish(&self.format))?;
        for (output, sections) in std::mem::take(&mut self.waiting) {
            write_stream(&output, &self.format.whole(&sections)?)?;
        }
        Ok(())
    }

    /// Writes a section to a stream, or keeps it for the one document of a run.
    fn stream(
        &mut self,
        output: Output,
        key: String,
        section: F::Section,
    ) -> Result<(), ReportError> {
        let is_document = self.format.appended(&key, &section).is_none();
        if self.is_run && is_document {
            self.waiting.entry(output).or_default().insert(key, section);
            return Ok(());
        }
        write_stream(&output, &self.format.alone(key, section)?)
    }

    fn open(&mut self, path: &Path) -> Result<(), ReportError> {
        if !self.artifact_stores.contains_key(path) {
            let artifacts = ArtifactStore::open(path, &self.format, self.keep, self.is_run)?;
            self.artifact_stores.insert(path.to_owned(), artifacts);
        }
        Ok(())
    }
}

/// Writes to the stream of an output, or to stdout if the output is not a stream.
///
/// # Errors
/// [`ReportError::Write`].
pub fn write_stream(output: &Output, text: &str) -> Result<(), ReportError> {
    use std::io::Write as _;
    let written = match output {
        Output::Stderr => {
            let mut err = std::io::stderr().lock();
            err.write_all(text.as_bytes()).and_then(|()| err.flush())
        }
        _ => {
            let mut out = std::io::stdout().lock();
            out.write_all(text.as_bytes()).and_then(|()| out.flush())
        }
    };
    // A closed pipe means that the reader needs no more output, which is not an error.
    if let Err(error) = &written
        && error.kind() == std::io::ErrorKind::BrokenPipe
    {
        return Ok(());
    }
    written.map_err(|source| ReportError::Write {
        path: match output {
            Output::Stderr => "__stderr__".into(),
            _ => "__stdout__".into(),
        },
        source,
    })
}

//! Everything between a rendered report and the place where it belongs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Param;
use qcbus_messages::{ResultMessage, Withdrawn};

use crate::{Format, Output, ReportError, Shelf, replace_file};

/// The file that a report is about, and what its reporter was told.
#[derive(Debug, Clone, Copy)]
pub struct Subject<'m> {
    /// Absolute path of the file.
    pub input: &'m str,
    /// Path for people.
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

/// Puts reports where the parameter `OutputFile` wants them, and takes them back.
pub struct Outlet<F> {
    format: F,
    suffix: &'static str,
    keep: bool,
    shelves: BTreeMap<PathBuf, Shelf>,
}

impl<F: Format> Outlet<F> {
    /// An outlet for reports of one form; `suffix` (without a dot) is that of reports in files of
    /// their own. With `keep`, what the one file for all already holds stays in it: for a daemon
    /// that is started again beside the same broker.
    pub fn new(format: F, suffix: &'static str, keep: bool) -> Outlet<F> {
        Outlet {
            format,
            suffix,
            keep,
            shelves: BTreeMap::new(),
        }
    }

    /// Writes a report; when this returns `Ok`, it is where it belongs.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn put(&mut self, subject: Subject<'_>, text: String) -> Result<(), ReportError> {
        let output = Output::of(subject.params);
        match &output {
            Output::Stdout => stream("__stdout__", &mut std::io::stdout().lock(), &text),
            Output::Stderr => stream("__stderr__", &mut std::io::stderr().lock(), &text),
            Output::File(path) => {
                let key = self.format.key(subject);
                let section = self.format.section(&key, text);
                self.shelf(path)?
                    .map_or(Ok(()), |shelf| shelf.put(&key, section))
            }
            Output::BesideResult | Output::Directory(_) => {
                match output.own_file(subject, self.suffix) {
                    Some(path) => replace_file(&path, text.as_bytes()),
                    None => Ok(()),
                }
            }
        }
    }

    /// Takes back what was written about a file that has gone. What went to a stream stays there.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn withdraw(&mut self, subject: Subject<'_>) -> Result<(), ReportError> {
        let output = Output::of(subject.params);
        match &output {
            Output::Stdout | Output::Stderr => Ok(()),
            Output::File(path) => {
                let key = self.format.key(subject);
                self.shelf(path)?
                    .map_or(Ok(()), |shelf| shelf.withdraw(&key))
            }
            Output::BesideResult | Output::Directory(_) => {
                match output.own_file(subject, self.suffix) {
                    Some(path) => remove_file(&path),
                    None => Ok(()),
                }
            }
        }
    }

    /// Brings the sections of files for all in the order of their paths.
    ///
    /// # Errors
    /// [`ReportError::Write`].
    pub fn finish(&mut self) -> Result<(), ReportError> {
        self.shelves.values_mut().try_for_each(Shelf::sort)
    }

    fn shelf(&mut self, path: &Path) -> Result<Option<&mut Shelf>, ReportError> {
        if !self.shelves.contains_key(path) {
            let shelf = Shelf::open(path, &self.format, self.keep)?;
            self.shelves.insert(path.to_owned(), shelf);
        }
        Ok(self.shelves.get_mut(path))
    }
}

fn remove_file(path: &Path) -> Result<(), ReportError> {
    match std::fs::remove_file(path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(ReportError::Write {
            path: path.to_owned(),
            source,
        }),
        _ => Ok(()),
    }
}

fn stream(name: &str, out: &mut dyn std::io::Write, text: &str) -> Result<(), ReportError> {
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written.map_err(|source| ReportError::Write {
        path: name.into(),
        source,
    })
}

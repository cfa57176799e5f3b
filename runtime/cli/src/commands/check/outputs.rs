//! Output on the terminal and additional report files.

use std::path::Path;

use qcbus_document::FileKind;
use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_messages::path_text::to_text;
use qcbus_reporter_sdk::{FileSources, Registration, Reporter, Setting};

use super::{Refusal, usage};
use crate::args::{OutputFormat, PrintArgs, TerminalFormat};
use crate::commands::settings::real;
use crate::{standard, talk};

/// Content of stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Terminal {
    /// Each finding in full with its source line for a single file; a line for each finding for
    /// several files.
    Fitting,
    /// Each finding in full.
    Full,
    /// A line for each finding.
    Concise,
    /// Only the output of a reporter, without other text.
    Reporter,
}

impl From<TerminalFormat> for Terminal {
    fn from(format: TerminalFormat) -> Terminal {
        match format {
            TerminalFormat::Full => Terminal::Full,
            TerminalFormat::Concise => Terminal::Concise,
        }
    }
}

/// All outputs of the findings.
pub(super) struct Outputs {
    /// Content of stdout.
    pub(super) terminal: Terminal,
    reporters: Vec<Output>,
}

/// One reporter and its output.
struct Output {
    alias: &'static str,
    reporter: Box<dyn Reporter>,
    /// Value of its parameter `OutputFile`.
    to: String,
    failed: bool,
}

impl Outputs {
    /// Returns the outputs of the flags. A format without a file goes to stdout; a page into `out`.
    pub(super) fn new(args: &PrintArgs, out: &Path) -> Result<Outputs, Refusal> {
        let mut outputs = Outputs {
            terminal: Terminal::Fitting,
            reporters: Vec::new(),
        };
        let mut printed: Option<&OutputFormat> = None;
        for format in &args.output_format {
            let file = match &format.file {
                Some(file) if file.as_os_str() == "-" => None,
                Some(file) => Some(file.clone()),
                None if format.is_page() => Some(out.join("report.html")),
                None => None,
            };
            if let Some(file) = &file {
                outputs.refuse_twice(file)?;
            }
            if file.is_none()
                && let Some(other) = printed.replace(format)
            {
                return Err(usage(format!(
                    "{other} and {format} cannot both be printed; write one of them to a file: \
                     --output-format {format}=FILE"
                )));
            }
            outputs.add(format, file.as_deref())?;
        }
        Ok(outputs)
    }

    /// Rejects two reports in one file, because one of them would be lost.
    fn refuse_twice(&self, file: &Path) -> Result<(), Refusal> {
        let to = to_text(&real(file));
        match self.reporters.iter().find(|it| it.to == to) {
            None => Ok(()),
            Some(other) => Err(usage(format!(
                "{} is already the file of the {} report: name another one",
                to_text(file),
                other.alias
            ))),
        }
    }

    fn add(&mut self, format: &OutputFormat, file: Option<&Path>) -> Result<(), Refusal> {
        let to = match (file, format.terminal()) {
            (None, Some(terminal)) => {
                self.terminal = terminal.into();
                return Ok(());
            }
            (None, None) => {
                self.terminal = Terminal::Reporter;
                "__stdout__".to_owned()
            }
            (Some(file), _) => {
                report_place(file)?;
                to_text(&real(file))
            }
        };
        let registration: &Registration = format.registration;
        let setting = Setting {
            color: talk::color() && file.is_none(),
            keep: false,
            is_run: true,
            pages: standard::page,
        };
        self.reporters.push(Output {
            alias: registration.alias,
            reporter: (registration.make)(&setting),
            to,
            failed: false,
        });
        Ok(())
    }

    /// Checks whether there are no reporters, so only the program itself prints results.
    pub(super) fn are_none(&self) -> bool {
        self.reporters.is_empty()
    }

    /// Passes a result to all reporters.
    pub(super) fn report(&mut self, message: &mut ResultMessage, sources: &FileSources) {
        for output in &mut self.reporters {
            message.params = vec![Param {
                name: "OutputFile".to_owned(),
                value: output.to.clone(),
            }];
            if let Err(error) = output.reporter.report(message, sources) {
                output.fails(&error.to_string());
            }
        }
    }

    /// Finishes all reporters after the last result. Returns whether all reports are complete.
    pub(super) fn finish(&mut self) -> bool {
        for output in &mut self.reporters {
            if let Err(error) = output.reporter.finish() {
                output.fails(&error.to_string());
            }
        }
        self.reporters.iter().all(|output| !output.failed)
    }

    /// Discards the reports because the check is incomplete and a partial report looks like a full
    /// one. Returns their names and places.
    pub(super) fn give_up(&mut self) -> Vec<String> {
        let named = |output: &mut Output| {
            output.failed = true;
            format!("{} ({})", output.alias, output.to)
        };
        self.reporters.iter_mut().map(named).collect()
    }

    /// Returns the files that were written.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        let written = self.reporters.iter().filter(|output| !output.failed);
        let to = written.map(|output| output.to.as_str());
        to.filter(|to| *to != "__stdout__")
    }
}

impl Output {
    /// Reports a failure once, because the other results would fail in the same way.
    fn fails(&mut self, why: &str) {
        if !std::mem::replace(&mut self.failed, true) {
            talk::fail(&format!("the {} report: failed to {why}", self.alias));
        }
    }
}

/// Rejects a report file that is not writable or must not be overwritten, before the check starts.
/// It also removes the report of an earlier run.
pub(in crate::commands) fn report_place(file: &Path) -> Result<(), Refusal> {
    let shown = to_text(file);
    let is_result = file.extension().is_some_and(|it| it == "xqar");
    if is_result || FileKind::of_path(file).is_some() {
        return Err(usage(format!(
            "the report would overwrite {shown}, which is a file to check or a result; name another one"
        )));
    }
    if shown.is_empty() || shown.ends_with('/') || file.is_dir() {
        return Err(usage(format!(
            "cannot write a report to {shown}: name a file"
        )));
    }
    let is_device = ["/dev/", "/proc/"].iter().any(|it| shown.starts_with(it));
    let data = std::fs::metadata(file);
    if !is_device && data.is_ok_and(|data| !data.is_file()) {
        return Err(usage(format!(
            "cannot write a report to {shown}: it is not a regular file"
        )));
    }
    let cleared = qcbus_reporter_sdk::clear_place(file);
    cleared.map_err(|error| {
        usage(format!(
            "failed to {error}; name another file for the report"
        ))
    })
}

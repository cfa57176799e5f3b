//! What is printed, and what is written besides.

use std::path::Path;

use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_messages::path_text::to_text;
use qcbus_reporter_sdk::{FileSources, Registration, Reporter, Setting};

use super::{Refusal, usage};
use crate::args::{OutputFormat, PrintArgs, TerminalFormat};
use crate::{standard, talk};

/// What goes to stdout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Terminal {
    /// Each finding in full with its line of the file, if one file is checked; a line for each if it is
    /// several.
    Fitting,
    /// Each finding in full.
    Full,
    /// A line for each finding.
    Concise,
    /// What a reporter writes; nothing of ours is between.
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

/// Everything that the findings go to.
pub(super) struct Outputs {
    /// What stdout is for.
    pub(super) terminal: Terminal,
    reporters: Vec<Output>,
}

/// One reporter, and where it writes.
struct Output {
    alias: &'static str,
    reporter: Box<dyn Reporter>,
    /// The value of its parameter `OutputFile`.
    to: String,
    failed: bool,
}

impl Outputs {
    /// What the flags ask for. A format without a file goes to stdout; a page goes into `out`.
    pub(super) fn new(args: &PrintArgs, out: &Path) -> Result<Outputs, Refusal> {
        let mut outputs = Outputs {
            terminal: Terminal::Fitting,
            reporters: Vec::new(),
        };
        let mut printed: Option<&OutputFormat> = None;
        for format in &args.output_format {
            let file = match &format.file {
                Some(file) => Some(file.clone()),
                None if format.is_page() => Some(out.join("report.html")),
                None => None,
            };
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
                writable(file)?;
                to_text(&super::absolute(file))
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

    /// Gives a result to all of them.
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

    /// All results were given. Says whether everything is where it belongs.
    pub(super) fn finish(&mut self) -> bool {
        for output in &mut self.reporters {
            if let Err(error) = output.reporter.finish() {
                output.fails(&error.to_string());
            }
        }
        self.reporters.iter().all(|output| !output.failed)
    }

    /// The formats that wait for the end of the run, and where they were to go.
    pub(super) fn names(&self) -> Vec<String> {
        let named = |output: &Output| format!("{} ({})", output.alias, output.to);
        self.reporters.iter().map(named).collect()
    }

    /// The files that were written.
    pub(super) fn files(&self) -> impl Iterator<Item = &str> {
        let written = self.reporters.iter().filter(|output| !output.failed);
        let to = written.map(|output| output.to.as_str());
        to.filter(|to| *to != "__stdout__")
    }
}

impl Output {
    /// Said once: what refuses one result refuses all.
    fn fails(&mut self, why: &str) {
        if !std::mem::replace(&mut self.failed, true) {
            talk::fail(&format!("the {} report: failed to {why}", self.alias));
        }
    }
}

/// Refuses a file for a report that cannot be written, before anything is checked for it.
fn writable(file: &Path) -> Result<(), Refusal> {
    let shown = to_text(file);
    if shown.is_empty() || shown.ends_with('/') || file.is_dir() {
        return Err(usage(format!(
            "cannot write a report to {shown}: name a file"
        )));
    }
    let directory = match file.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    super::writable(&super::absolute(directory))
}

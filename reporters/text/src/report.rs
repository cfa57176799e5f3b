//! The daemon: where the text goes.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Param;
use qcbus_messages::{ResultMessage, Withdrawn};
use qcbus_reporter_sdk::{
    Format, Outlet, Output, ReportError, Reporter, Sources, Subject, one_line, param,
};

use crate::{Options, render};

/// Columns unless `LineWidth` says otherwise; ASAM's report has the same.
pub const DEFAULT_WIDTH: usize = 100;

/// Writes text reports.
pub struct TextReporter {
    /// Whether to colour what goes to `__stdout__` and `__stderr__`. Files are never coloured.
    color: bool,
    outlet: Outlet<Sections>,
}

impl TextReporter {
    /// A reporter that has written nothing yet. `color`: whether to colour what goes to
    /// `__stdout__` and `__stderr__`; files are never coloured. `keep`: whether reports that the
    /// one file of `OutputFile` already holds stay in it.
    pub fn new(color: bool, keep: bool) -> TextReporter {
        TextReporter {
            color,
            outlet: Outlet::new(Sections, "txt", keep),
        }
    }
}

impl Reporter for TextReporter {
    fn report(&mut self, result: &ResultMessage, sources: &dyn Sources) -> Result<(), ReportError> {
        let output = Output::of(&result.params);
        let streamed = matches!(output, Output::Stdout | Output::Stderr);
        let options = Options {
            width: line_width(&result.params)?,
            color: self.color && streamed,
            inapplicable: !streamed,
            ..Options::default()
        };
        let text = render(result, &options, sources);
        self.outlet.put(Subject::from(result), text)
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        self.outlet.withdraw(Subject::from(gone))
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.outlet.finish()
    }
}

fn line_width(params: &[Param]) -> Result<usize, ReportError> {
    let Some(value) = param(params, "LineWidth").filter(|value| !value.is_empty()) else {
        return Ok(DEFAULT_WIDTH);
    };
    match value.trim().parse() {
        Ok(width @ 40..=1000) => Ok(width),
        _ => Err(ReportError::Param {
            name: "LineWidth".into(),
            value: value.into(),
            why: "a whole number from 40 to 1000 is needed".into(),
        }),
    }
}

/// Both ends of the line that begins a section of the one file.
const RULER: &str = "====";

/// Sections under `==== PATH ====`. No other line of a report begins with a ruler.
struct Sections;

impl Format for Sections {
    fn key(&self, subject: Subject<'_>) -> String {
        one_line(subject.display_path)
    }

    fn section(&self, key: &str, text: String) -> String {
        format!("{RULER} {key} {RULER}\n{text}\n")
    }

    fn split(&self, text: &str) -> BTreeMap<String, String> {
        let mut sections = BTreeMap::<String, String>::new();
        let mut current: Option<String> = None;
        for line in text.split_inclusive('\n') {
            if let Some(key) = key_of(line) {
                sections.remove(key);
                current = Some(key.to_owned());
            }
            if let Some(key) = &current {
                sections.entry(key.clone()).or_default().push_str(line);
            }
        }
        sections.retain(|_, section| section.ends_with("\n\n"));
        sections
    }
}

fn key_of(line: &str) -> Option<&str> {
    let line = line.strip_suffix('\n')?;
    let key = line.strip_prefix(RULER)?.strip_suffix(RULER)?;
    key.strip_prefix(' ')?.strip_suffix(' ')
}

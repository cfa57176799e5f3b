//! The daemon: where the text goes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{
    Format, Output, ReportError, Reporter, Shelf, Sources, one_line, param, replace_file,
};

use crate::{Options, render};

/// Columns unless `LineWidth` says otherwise; ASAM's report has the same.
pub const DEFAULT_WIDTH: usize = 100;

/// Writes text reports.
#[derive(Default)]
pub struct TextReporter {
    /// Whether to colour what goes to `__stdout__` and `__stderr__`. Files are never coloured.
    pub color: bool,
    /// Whether reports that the one file of `OutputFile` already holds stay in it: for a daemon
    /// that is started again beside the same broker.
    pub keep: bool,
    shelves: BTreeMap<PathBuf, Shelf>,
}

impl TextReporter {
    /// A reporter that has written nothing yet.
    pub fn new(color: bool, keep: bool) -> TextReporter {
        TextReporter {
            color,
            keep,
            shelves: BTreeMap::new(),
        }
    }

    fn shelve(&mut self, path: &Path, key: &str, text: &str) -> Result<(), ReportError> {
        let section = format!("{RULER} {key} {RULER}\n{text}\n");
        if !self.shelves.contains_key(path) {
            let shelf = Shelf::open(path, &Sections, self.keep)?;
            self.shelves.insert(path.to_owned(), shelf);
        }
        match self.shelves.get_mut(path) {
            Some(shelf) => shelf.put(key, section),
            None => Ok(()),
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
            ..Options::default()
        };
        let text = render(result, &options, sources);
        match output {
            Output::Stdout => stream("__stdout__", &mut std::io::stdout().lock(), &text),
            Output::Stderr => stream("__stderr__", &mut std::io::stderr().lock(), &text),
            Output::File(path) => self.shelve(&path, &one_line(&result.display_path), &text),
            Output::BesideResult | Output::Directory(_) => match output.own_file(result, "txt") {
                Some(path) => replace_file(&path, text.as_bytes()),
                None => Ok(()),
            },
        }
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.shelves.values_mut().try_for_each(Shelf::sort)
    }
}

fn stream(name: &str, out: &mut dyn std::io::Write, text: &str) -> Result<(), ReportError> {
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written.map_err(|source| ReportError::Write {
        path: name.into(),
        source,
    })
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

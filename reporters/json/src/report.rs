//! The daemon: where the JSON goes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{
    Format, Output, ReportError, Reporter, Shelf, Sources, param, replace_file,
};

use crate::{DEFAULT_INDENT, render};

/// Writes JSON reports.
#[derive(Default)]
pub struct JsonReporter {
    keep: bool,
    shelves: BTreeMap<PathBuf, Shelf>,
}

impl JsonReporter {
    /// A reporter that has written nothing yet. With `keep`, the documents that the one file of
    /// `OutputFile` already holds stay in it: for a daemon that is started again.
    pub fn new(keep: bool) -> JsonReporter {
        JsonReporter {
            keep,
            shelves: BTreeMap::new(),
        }
    }

    fn shelve(&mut self, path: &Path, key: &str, text: String) -> Result<(), ReportError> {
        if !self.shelves.contains_key(path) {
            let shelf = Shelf::open(path, &Documents, self.keep)?;
            self.shelves.insert(path.to_owned(), shelf);
        }
        match self.shelves.get_mut(path) {
            Some(shelf) => shelf.put(key, text),
            None => Ok(()),
        }
    }
}

impl Reporter for JsonReporter {
    fn report(&mut self, result: &ResultMessage, _: &dyn Sources) -> Result<(), ReportError> {
        let indent = indent(&result.params)?;
        let text = render(result, indent).map_err(|error| ReportError::Form(error.to_string()))?;
        let output = Output::of(&result.params);
        match output {
            Output::Stdout => stream("__stdout__", &mut std::io::stdout().lock(), &text),
            Output::Stderr => stream("__stderr__", &mut std::io::stderr().lock(), &text),
            Output::File(path) => self.shelve(&path, &result.input, text),
            Output::BesideResult | Output::Directory(_) => match output.own_file(result, "json") {
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

fn indent(params: &[Param]) -> Result<usize, ReportError> {
    let Some(value) = param(params, "Indent").filter(|value| !value.is_empty()) else {
        return Ok(DEFAULT_INDENT);
    };
    match value.trim().parse() {
        Ok(indent @ 0..=16) => Ok(indent),
        _ => Err(ReportError::Param {
            name: "Indent".into(),
            value: value.into(),
            why: "a whole number from 0 to 16 is needed".into(),
        }),
    }
}

/// A sequence of JSON documents, each with `qcbus.inputFile`.
struct Documents;

impl Format for Documents {
    fn split(&self, text: &str) -> BTreeMap<String, String> {
        let mut sections = BTreeMap::new();
        let mut stream = serde_json::Deserializer::from_str(text).into_iter();
        let mut start = 0;
        while let Some(Ok(document)) = stream.next() {
            let document: serde_json::Value = document;
            let end = stream.byte_offset();
            if let Some(path) = document["qcbus"]["inputFile"].as_str() {
                let section = text[start..end].trim();
                sections.insert(path.to_owned(), format!("{section}\n"));
            }
            start = end;
        }
        sections
    }
}

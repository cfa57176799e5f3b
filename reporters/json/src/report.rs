//! The daemon: where the JSON goes.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Param;
use qcbus_messages::{ResultMessage, Withdrawn};
use qcbus_reporter_sdk::{Format, Outlet, ReportError, Reporter, Sources, Subject, param};

use crate::{DEFAULT_INDENT, render};

/// Writes JSON reports.
pub struct JsonReporter {
    outlet: Outlet<Documents>,
}

impl JsonReporter {
    /// A reporter that has written nothing yet. With `keep`, the documents that the one file of
    /// `OutputFile` already holds stay in it: for a daemon that is started again.
    pub fn new(keep: bool) -> JsonReporter {
        JsonReporter {
            outlet: Outlet::new(Documents, "json", keep),
        }
    }
}

impl Reporter for JsonReporter {
    fn report(&mut self, result: &ResultMessage, _: &dyn Sources) -> Result<(), ReportError> {
        let indent = indent(&result.params)?;
        let text = render(result, indent).map_err(|error| ReportError::Form(error.to_string()))?;
        self.outlet.put(Subject::from(result), text)
    }

    fn withdraw(&mut self, gone: &Withdrawn) -> Result<(), ReportError> {
        self.outlet.withdraw(Subject::from(gone))
    }

    fn finish(&mut self) -> Result<(), ReportError> {
        self.outlet.finish()
    }
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
    fn key(&self, subject: Subject<'_>) -> String {
        subject.input.to_owned()
    }

    fn section(&self, _: &str, text: String) -> String {
        text
    }

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

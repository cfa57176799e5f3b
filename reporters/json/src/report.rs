//! The JSON reporter: writes the documents to their target.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{Destination, ReportError, ReportFormat, Sources, param};

use crate::{DEFAULT_INDENT, render};

/// A sequence of JSON documents, each with `qcbus.inputFile`.
pub(crate) struct Documents;

impl ReportFormat for Documents {
    type Section = String;
    const SUFFIX: &'static str = "json";

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        place: Destination,
    ) -> Result<String, ReportError> {
        let indent = indent(&result.params, place)?;
        render(result, indent).map_err(|error| ReportError::Form(error.to_string()))
    }

    fn whole(&self, sections: &BTreeMap<String, String>) -> Result<String, ReportError> {
        Ok(sections.values().map(String::as_str).collect())
    }

    fn appended(&self, _: &str, section: &String) -> Option<String> {
        Some(section.clone())
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

/// Returns the indent. Several documents in sequence have one line each by default.
fn indent(params: &[Param], place: Destination) -> Result<usize, ReportError> {
    let Some(value) = param(params, "Indent").filter(|value| !value.is_empty()) else {
        return Ok(match place {
            Destination::Stream { .. } | Destination::SharedFile => 0,
            Destination::OwnFile => DEFAULT_INDENT,
        });
    };
    match value.trim().parse() {
        Ok(indent @ 0..=16) => Ok(indent),
        _ => Err(ReportError::Param {
            name: "Indent".into(),
            value: value.into(),
            why: "expected an integer from 0 to 16".into(),
        }),
    }
}

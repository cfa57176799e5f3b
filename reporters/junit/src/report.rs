//! Conversion of suites of checked files into one document, and back.

use std::collections::BTreeMap;

use qcbus_formats::xqar::Param;
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{Destination, ReportError, ReportFormat, Sources, Subject, param};
use quick_junit::{Report, TestSuite};

use crate::suite::{self, INPUT, Inapplicable};
use crate::text::path;

/// One `testsuites` with a suite per checked file.
#[derive(Debug, Clone, Copy)]
pub struct Suites;

impl ReportFormat for Suites {
    type Section = TestSuite;
    const SUFFIX: &'static str = "junit.xml";

    fn key(&self, subject: Subject<'_>) -> String {
        path(subject.input)
    }

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        _: Destination,
    ) -> Result<TestSuite, ReportError> {
        Ok(suite::suite(result, inapplicable(&result.params)?))
    }

    fn whole(&self, sections: &BTreeMap<String, TestSuite>) -> Result<String, ReportError> {
        let mut report = Report::new("qcbus");
        report.add_test_suites(sections.values().cloned());
        let text = report
            .to_string()
            .map_err(|error| ReportError::Form(error.to_string()))?;
        // The schema allows this number at a suite but not at the root. The root's tag comes first.
        let extension = format!(" skipped=\"{}\"", report.skipped);
        Ok(text.replacen(&extension, "", 1))
    }

    fn split(&self, text: &str) -> BTreeMap<String, TestSuite> {
        let report = Report::deserialize_from_str(text);
        let suites = report.map_or_else(|_| Vec::new(), |report| report.test_suites);
        let keyed = suites.into_iter().filter_map(|suite| {
            let mut properties = suite.properties.iter();
            let input = properties.find(|property| property.name.as_str() == INPUT)?;
            Some((input.value.as_str().to_owned(), suite))
        });
        keyed.collect()
    }
}

fn inapplicable(params: &[Param]) -> Result<Inapplicable, ReportError> {
    match param(params, "Inapplicable").map(str::trim) {
        None | Some("" | "counted") => Ok(Inapplicable::Counted),
        Some("listed") => Ok(Inapplicable::Listed),
        Some(value) => Err(ReportError::Param {
            name: "Inapplicable".into(),
            value: value.into(),
            why: "expected `counted` or `listed`".into(),
        }),
    }
}

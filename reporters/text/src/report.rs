//! The text reporter: builds and splits text reports.

use std::collections::BTreeMap;

use qcbus_formats::xqar::{Level, Param};
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{
    Destination, ReportError, ReportFormat, Sources, Subject, one_line, param,
};

use crate::{Folding, Options, concise, render};

/// Number of columns without `LineWidth`, the same as in ASAM's report.
pub const DEFAULT_WIDTH: usize = 100;

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

/// Start and end of the line before a section in a shared file.
const RULER: &str = "====";

/// Format with a line for each finding.
pub(crate) struct Concise;

impl ReportFormat for Concise {
    type Section = String;
    const SUFFIX: &'static str = "concise.txt";

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        place: Destination,
    ) -> Result<String, ReportError> {
        let color = place == Destination::Stream { color: true };
        Ok(concise(result, color, Folding::None))
    }

    fn key(&self, subject: Subject<'_>) -> String {
        shown::line(subject.display_path).into_owned()
    }

    fn whole(&self, sections: &BTreeMap<String, String>) -> Result<String, ReportError> {
        Ok(sections.values().map(String::as_str).collect())
    }

    fn appended(&self, _: &str, section: &String) -> Option<String> {
        Some(section.clone())
    }

    fn split(&self, text: &str) -> BTreeMap<String, String> {
        let mut sections = BTreeMap::<String, String>::new();
        for line in text.split_inclusive('\n').filter(|it| it.ends_with('\n')) {
            let key = path_of(line).unwrap_or_default();
            sections.entry(key.to_owned()).or_default().push_str(line);
        }
        sections
    }
}

/// Returns the path at the start of a line of [`concise`].
fn path_of(line: &str) -> Option<&str> {
    let levels = [Level::Error, Level::Warning, Level::Information];
    let levels = levels.map(|level| format!(": {}: ", level.as_str()));
    let open = format!(": {}: ", Verdict::Undetermined);
    let at = levels.iter().chain([&open]).filter_map(|it| line.find(it));
    let place = line.get(..at.min()?)?;
    let number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let without = |place| match str::rsplit_once(place, ':') {
        Some((path, last)) if number(last) => path,
        _ => place,
    };
    Some(without(without(place)))
}

/// Format of full reports. In a shared file each report is under `==== PATH ====`. No other line of
/// a report begins with a ruler.
pub(crate) struct Full;

impl ReportFormat for Full {
    type Section = String;
    const SUFFIX: &'static str = "txt";

    fn key(&self, subject: Subject<'_>) -> String {
        one_line(subject.display_path)
    }

    fn section(
        &self,
        result: &ResultMessage,
        sources: &dyn Sources,
        place: Destination,
    ) -> Result<String, ReportError> {
        let options = Options {
            width: line_width(&result.params)?,
            color: place == Destination::Stream { color: true },
            inapplicable: !matches!(place, Destination::Stream { .. }),
            ..Options::default()
        };
        Ok(render(result, &options, sources))
    }

    fn whole(&self, sections: &BTreeMap<String, String>) -> Result<String, ReportError> {
        let parts = sections.iter().map(|(key, text)| under_ruler(key, text));
        Ok(parts.collect())
    }

    fn alone(&self, _: String, section: String) -> Result<String, ReportError> {
        Ok(section)
    }

    fn appended(&self, key: &str, section: &String) -> Option<String> {
        Some(under_ruler(key, section))
    }

    fn split(&self, text: &str) -> BTreeMap<String, String> {
        let mut sections = BTreeMap::<String, String>::new();
        let mut current: Option<String> = None;
        for line in text.split_inclusive('\n') {
            if let Some(key) = key_of(line) {
                sections.remove(key);
                current = Some(key.to_owned());
            } else if let Some(key) = &current {
                sections.entry(key.clone()).or_default().push_str(line);
            }
        }
        // A truncated section does not end in an empty line.
        sections.retain(|_, section| section.ends_with("\n\n") && section.pop().is_some());
        sections
    }
}

fn under_ruler(key: &str, text: &str) -> String {
    format!("{RULER} {key} {RULER}\n{text}\n")
}

fn key_of(line: &str) -> Option<&str> {
    let line = line.strip_suffix('\n')?;
    let key = line.strip_prefix(RULER)?.strip_suffix(RULER)?;
    key.strip_prefix(' ')?.strip_suffix(' ')
}

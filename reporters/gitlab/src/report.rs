//! Conversion of sections into one JSON array, and back.

use std::collections::BTreeMap;

use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{
    Destination, Repeats, ReportError, ReportFormat, Sources, fingerprint_of,
};

use crate::entry::{Entry, Lines, Location, Own, Severity};
use crate::section::Section;

/// Maximum number of entries, about 10 MB of text. The entry about left-out ones is extra.
pub const MOST_ENTRIES: usize = 25_000;

/// Name of the entry about left-out entries, and key of its section. It differs from every path.
const LEFT_OUT: &str = "qcbus/left_out";

/// Results as a GitLab code quality report.
#[derive(Debug, Clone, Copy, Default)]
pub struct CodeQuality;

impl ReportFormat for CodeQuality {
    type Section = Section;
    const SUFFIX: &'static str = "codequality.json";

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        _: Destination,
    ) -> Result<Section, ReportError> {
        Ok(Section::of(result))
    }

    fn whole(&self, sections: &BTreeMap<String, Section>) -> Result<String, ReportError> {
        let all = sections.values().flat_map(|section| &section.entries);
        let mut entries: Vec<Entry> = all.cloned().collect();
        entries.sort_by_key(|entry| entry.severity);
        if let Some(entry) = left_out(&entries) {
            entries.truncate(MOST_ENTRIES);
            entries.insert(0, entry);
        }
        let mut repeats = Repeats::default();
        for entry in &mut entries {
            if let number @ 2.. = repeats.number(&entry.fingerprint) {
                entry.fingerprint = format!("{}-{number}", entry.fingerprint);
            }
        }
        let text = serde_json::to_string_pretty(&entries);
        let text = text.map_err(|error| ReportError::Form(error.to_string()))?;
        Ok(text + "\n")
    }

    fn split(&self, text: &str) -> BTreeMap<String, Section> {
        let mut sections: BTreeMap<String, Section> = BTreeMap::new();
        for mut entry in serde_json::from_str::<Vec<Entry>>(text).unwrap_or_default() {
            if let Some((bare, _)) = entry.fingerprint.split_once('-') {
                entry.fingerprint = bare.to_owned();
            }
            // Entries left out earlier cannot be counted again, so their entry is kept.
            let key = match entry.check_name.as_str() {
                LEFT_OUT if entry.qcbus.path.is_empty() => LEFT_OUT,
                _ => &entry.qcbus.path,
            };
            let section = sections.entry(key.to_owned()).or_default();
            section.entries.push(entry);
        }
        sections
    }
}

/// Returns an entry with the number of left-out entries by severity. It belongs to no file. GitLab
/// shows no entry without a place, so it stands at the first file with left-out entries.
fn left_out(entries: &[Entry]) -> Option<Entry> {
    let rest = entries
        .get(MOST_ENTRIES..)
        .filter(|rest| !rest.is_empty())?;
    let of = |severity| {
        rest.iter()
            .filter(|entry| entry.severity == severity)
            .count()
    };
    let description = format!(
        "only the {MOST_ENTRIES} most severe of {} entries are in this report; left out: {} blocker, {} major, \
         {} minor, {} info",
        entries.len(),
        of(Severity::Blocker),
        of(Severity::Major),
        of(Severity::Minor),
        of(Severity::Info)
    );
    Some(Entry {
        description,
        check_name: LEFT_OUT.to_owned(),
        fingerprint: fingerprint_of(&[LEFT_OUT]),
        severity: Severity::Blocker,
        location: Location {
            path: rest.first()?.location.path.clone(),
            lines: Lines { begin: 1 },
        },
        qcbus: Own {
            path: String::new(),
            verdict: String::new(),
        },
    })
}

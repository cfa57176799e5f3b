//! Conversion of sections of checked files into the log of a step, and back.

use std::collections::BTreeMap;

use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{Destination, ReportError, ReportFormat, Sources, Subject};

use crate::choice::Chosen;
use crate::command::{annotation, data, place_path, unescaped};
use crate::{Entry, Section};

const GROUP: &str = "::group::";
const END_OF_GROUP: &str = "::endgroup::";

/// The log of a step: all findings by file, then the annotations.
#[derive(Debug, Clone, Copy)]
pub struct Annotations;

impl ReportFormat for Annotations {
    type Section = Section;
    const SUFFIX: &'static str = "github.txt";

    /// Returns the display path, because annotations use the path in the repository.
    fn key(&self, subject: Subject<'_>) -> String {
        shown::line(subject.display_path).into_owned()
    }

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        _: Destination,
    ) -> Result<Section, ReportError> {
        Ok(Section::of(result))
    }

    fn whole(&self, sections: &BTreeMap<String, Section>) -> Result<String, ReportError> {
        let mut lines = Vec::new();
        for (key, section) in sections {
            log(&mut lines, key, section);
        }
        let entries: Vec<&Entry> = sections.values().flat_map(|it| &it.entries).collect();
        let choice = Chosen::of(&entries);
        lines.extend(choice.chosen.iter().map(|entry| annotation(entry)));
        let cut = choice.cut();
        lines.extend(cut.map(|said| format!("::notice title=qcbus::{}", data(&said))));
        Ok(lines.into_iter().map(|line| line + "\n").collect())
    }

    fn split(&self, text: &str) -> BTreeMap<String, Section> {
        let mut sections = BTreeMap::new();
        let mut open: Option<(String, Section)> = None;
        for line in text.split_inclusive('\n') {
            // A truncated log lacks the final line feed or the end of its group.
            let Some(line) = line.strip_suffix('\n') else {
                break;
            };
            if let Some(title) = line.strip_prefix(GROUP) {
                open = read_head(&unescaped(title));
            } else if line == END_OF_GROUP {
                sections.extend(open.take());
            } else if let Some((_, section)) = &mut open {
                section.entries.extend(Entry::read(line));
            } else {
                sections.extend(read_head(line));
            }
        }
        sections
    }
}

/// Appends the lines of a file: a group, or a single line if there is only a summary.
fn log(lines: &mut Vec<String>, key: &str, section: &Section) {
    let head = format!("{}: {}", place_path(key), section.summary);
    if section.entries.is_empty() {
        lines.push(head);
        return;
    }
    lines.push(format!("{GROUP}{}", data(&head)));
    lines.extend(section.entries.iter().map(Entry::to_string));
    lines.push(END_OF_GROUP.to_owned());
}

/// Returns the key and the section without entries, or `None` for a line of other origin.
fn read_head(line: &str) -> Option<(String, Section)> {
    let (path, summary) = line.split_once(": ")?;
    let (word, _) = summary.split_once(": ")?;
    let verdicts = [Verdict::Accepted, Verdict::Rejected, Verdict::Undetermined];
    let is_ours = !path.contains(':') && verdicts.iter().any(|it| it.as_str() == word);
    let section = Section {
        summary: summary.to_owned(),
        entries: Vec::new(),
    };
    is_ours.then(|| (unescaped(path), section))
}

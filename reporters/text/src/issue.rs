//! Rendering of one issue.

use std::fmt::Write as _;

use qcbus_formats::xqar::{DomainInfo, InfoElement, Level};
use qcbus_messages::{ResultMessage, shown};
use qcbus_reporter_sdk::{
    IssueLocation, Sources, one_line, path_for_people, printable, rounded, rule_name,
};

use crate::Entry;
use crate::paint::Paint;
use crate::snippet::snippet;
use crate::wrap::wrap;

/// Context for the rendering of an issue.
pub(crate) struct View<'v> {
    pub(crate) result: &'v ResultMessage,
    pub(crate) sources: &'v dyn Sources,
    pub(crate) paint: Paint,
    pub(crate) width: usize,
    /// Whether UID and checker are written in full, in addition to the rule's name in the headline.
    pub(crate) full_names: bool,
}

impl View<'_> {
    /// Writes the headline, the places with source lines, the rule, the reason, and a note about
    /// findings that are alike.
    pub(crate) fn write(
        &self,
        out: &mut String,
        entry: &Entry<'_>,
        why: Option<&str>,
        alike: &str,
    ) {
        let gutter = gutter(&entry.places);
        self.headline(out, entry);
        for (number, place) in entry.places.iter().enumerate() {
            self.place(out, place, entry.issue.level, gutter, number == 0);
        }
        if entry.places.is_empty() {
            let path = shown::line(&self.result.display_path);
            let arrow = self.paint.frame("-->");
            let _ = writeln!(out, "{:gutter$}{arrow} {path}", "");
        }
        let mut note = |name: &str, text: &str| self.note(out, gutter, name, text);
        if self.full_names {
            note("rule", &rule_of(entry));
        }
        for info in &entry.issue.domain_info {
            match info.name.as_str() {
                qcbus_formats::location::NAME => {}
                qcbus_formats::pool::RULE_INFO => note("also violates", &further_rules(info)),
                name => note(&one_line(name), &flat(info)),
            }
        }
        if let Some(why) = why {
            note("why", why);
        }
        if !alike.is_empty() {
            note("also", alike);
        }
    }

    fn headline(&self, out: &mut String, entry: &Entry<'_>) {
        let level = entry.issue.level;
        let text = printable(entry.issue.description.trim());
        let mut lines = text.lines();
        let first = self.paint.bold(lines.next().unwrap_or("(no description)"));
        let name = shown::line(rule_name(&entry.issue.rule_uid, &entry.checker.id));
        let head = self
            .paint
            .level(level, &format!("{}[{name}]", level.as_str()));
        let _ = writeln!(out, "{head}: {first}");
        for line in lines {
            let _ = writeln!(out, "    {}", line.trim_end());
        }
    }

    fn place(
        &self,
        out: &mut String,
        place: &IssueLocation,
        level: Level,
        gutter: usize,
        main: bool,
    ) {
        let arrow = self.paint.frame(if main { "-->" } else { ":::" });
        let _ = writeln!(out, "{:gutter$}{arrow} {}", "", self.name(place));
        let shown = self.snippet(out, place, level, gutter);
        if !shown && !place.description.is_empty() {
            self.note(out, gutter, "here", &place.description);
        }
        let facts = facts(place);
        if !facts.is_empty() {
            self.note(out, gutter, "at", &facts);
        }
        if let Some(at) = place.referred_at {
            let text = format!("{}{}", self.result.display_path, row_column(at));
            self.note(out, gutter, "referred to from", &text);
        }
        if !place.also.is_empty() {
            let also = place.also.iter().map(|&at| row_column(at)[1..].to_owned());
            self.note(out, gutter, "also at", &also.collect::<Vec<_>>().join(", "));
        }
    }

    /// Returns `PATH:ROW:COLUMN` without unknown parts.
    fn name(&self, place: &IssueLocation) -> String {
        let mut name = match &place.path {
            Some(path) => shown::line(path_for_people(self.result, path)).into_owned(),
            None => shown::line(&self.result.display_path).into_owned(),
        };
        if let Some(row) = place.row {
            name.push_str(&row_column((row, place.column.unwrap_or(0))));
        }
        name
    }

    /// Writes the source line with marks. Returns whether the line was available.
    fn snippet(
        &self,
        out: &mut String,
        place: &IssueLocation,
        level: Level,
        gutter: usize,
    ) -> bool {
        let Some(row) = place.row else { return false };
        let path = place.path.as_deref().unwrap_or(&self.result.input);
        let near = place.column.unwrap_or(1);
        let Some(line) = self.sources.line(path, row, near) else {
            return false;
        };
        let width = self.width.saturating_sub(gutter + 3).max(20);
        let shown = snippet(&line, place.column, width);
        let bar = self.paint.frame("|");
        let number = self.paint.frame(&format!("{row:>gutter$}"));
        let _ = writeln!(out, "{:gutter$} {bar}", "");
        let text = format!("{number} {bar} {}", shown.text);
        let _ = writeln!(out, "{}", text.trim_end());
        let description = one_line(&place.description);
        let (before, marks) = match shown.marks {
            Some((before, count)) => (before, "^".repeat(count)),
            None if description.is_empty() => return true,
            None => (0, String::new()),
        };
        let said = format!("{marks} {description}");
        let said = self.paint.level(level, said.trim());
        let _ = writeln!(out, "{:gutter$} {bar} {:before$}{said}", "", "");
        true
    }

    /// Writes a line `= name: text`; continuation lines are indented to the text.
    fn note(&self, out: &mut String, gutter: usize, name: &str, text: &str) {
        let indent = gutter + 3 + name.len() + 2;
        let lines = wrap(&printable(text), self.width.saturating_sub(indent).max(30));
        let sign = self.paint.frame("=");
        let name = self.paint.bold(&format!("{name}:"));
        for (number, line) in lines.iter().enumerate() {
            let _ = match number {
                0 => writeln!(out, "{:gutter$} {sign} {name} {line}", ""),
                _ => writeln!(out, "{:indent$}{line}", ""),
            };
        }
    }
}

/// Returns the number of columns for the largest row number. Rows larger than any file are invalid
/// data of other tools, so the width is limited.
fn gutter(places: &[IssueLocation]) -> usize {
    let rows = places.iter().filter_map(|place| place.row);
    rows.max().map_or(1, |row| row.to_string().len().min(8))
}

/// Returns the UIDs of further rules that the same fact violates.
fn further_rules(info: &DomainInfo) -> String {
    let values = info.content.iter().flat_map(|element| &element.attributes);
    let uids: Vec<String> = values.map(|(_, uid)| one_line(uid)).collect();
    uids.join(", ")
}

/// Returns the rule's UID and the checker. ASAM's checkers carry the rule's name, so a user needs
/// both to find either.
fn rule_of(entry: &Entry<'_>) -> String {
    let checker = format!("{}/{}", entry.bundle.name, entry.checker.id);
    match entry.issue.rule_uid.as_str() {
        "" => checker,
        uid => format!("{uid} ({checker})"),
    }
}

fn facts(place: &IssueLocation) -> String {
    let mut facts = Vec::new();
    if let Some(xpath) = &place.xpath {
        facts.push(xpath.clone());
    }
    if let Some((id, s, t)) = &place.road {
        let (s, t) = (rounded(*s), rounded(*t));
        facts.push(format!("road {id}, s = {s} m, t = {t} m"));
    }
    if let Some((x, y, z)) = place.inertial {
        let (x, y, z) = (rounded(x), rounded(y), rounded(z));
        facts.push(format!("x = {x} m, y = {y} m, z = {z} m"));
    }
    if let Some(time) = place.time {
        facts.push(format!("time {} s", rounded(time)));
    }
    if let Some((index, channel)) = &place.message {
        facts.push(format!("message {index} {channel}").trim_end().to_owned());
    }
    facts.join("; ")
}

/// Returns `:ROW:COLUMN`, or `:ROW` if the column is unknown.
fn row_column((row, column): (u64, u64)) -> String {
    match column {
        0 => format!(":{row}"),
        _ => format!(":{row}:{column}"),
    }
}

/// Returns a `DomainSpecificInfo` on one line: `Element key=value text, …`.
fn flat(info: &DomainInfo) -> String {
    let mut words = Vec::new();
    for element in &info.content {
        flatten(element, &mut words);
    }
    words.join(", ")
}

fn flatten(element: &InfoElement, words: &mut Vec<String>) {
    let attributes = element.attributes.iter();
    let pairs = attributes.map(|(name, value)| format!(" {name}={value}"));
    let said = format!(
        "{}{} {}",
        element.name,
        pairs.collect::<String>(),
        element.text
    );
    words.push(one_line(&said));
    words.retain(|word| !word.is_empty());
    for child in &element.children {
        flatten(child, words);
    }
}

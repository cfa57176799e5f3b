//! Rendering of one issue.

use std::fmt::Write as _;

use qcbus_formats::pool::{ALSO, ALSO_HERE, RULE_INFO};
use qcbus_formats::xqar::{DomainInfo, InfoElement, Level};
use qcbus_messages::{ResultMessage, shown};
use qcbus_reporter_sdk::{
    IssueLocation, Sources, one_line, path_for_people, printable, rounded, rule_name,
};

use crate::Entry;
use crate::alike::shape;
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
    /// Whether only the first few findings about the same fault are shown.
    pub(crate) merges: bool,
    /// Whether there are so many findings that only the main place of each has source lines.
    pub(crate) compact: bool,
}

/// Maximum number of shown findings about the same fault.
const MOST_JOINED: usize = 3;

/// Maximum number of shown places of which the same is true.
const MOST_ROWS: usize = 8;

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
        let (repeated, others): (Vec<_>, Vec<_>) = entry
            .places
            .iter()
            .partition(|place| place.description == ALSO_HERE);
        let (joined, places): (Vec<_>, Vec<_>) =
            others.into_iter().partition(|place| is_joined(place));
        let (main, further) = places.split_at(places.len().min(1));
        for place in main {
            self.main_place(out, place, entry.issue.level, gutter);
        }
        for place in further {
            match self.compact {
                true => self.further_place(out, place, gutter),
                false => self.place(out, place, entry.issue.level, gutter, false),
            }
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
                RULE_INFO => {
                    let rules = further_rules(info, &joined);
                    if !rules.is_empty() {
                        note("also violates", &rules);
                    }
                }
                name => note(&one_line(name), &flat(info)),
            }
        }
        if let Some(why) = why {
            note("why", why);
        }
        if !repeated.is_empty() {
            note("also at", &self.rows(&repeated));
        }
        for text in self.joined(&entry.issue.description, &joined) {
            note("also", &text);
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

    /// Writes the main place. In a compact report, information has no source lines.
    fn main_place(&self, out: &mut String, place: &IssueLocation, level: Level, gutter: usize) {
        if self.compact && level == Level::Information {
            let arrow = self.paint.frame("-->");
            let _ = writeln!(out, "{:gutter$}{arrow} {}", "", self.name(place));
        } else {
            self.place(out, place, level, gutter, true);
        }
    }

    /// Writes a further place on one line.
    fn further_place(&self, out: &mut String, place: &IssueLocation, gutter: usize) {
        let what = match one_line(&place.description) {
            what if what.is_empty() => "a further place".to_owned(),
            what => what,
        };
        self.note(
            out,
            gutter,
            "see",
            &format!("{what}{}", self.reference(place)),
        );
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

    /// Returns the texts of joined findings. When merged, those that differ only in numbers are shown
    /// once, and without what is allowed.
    fn joined(&self, main: &str, joined: &[&IssueLocation]) -> Vec<String> {
        if !self.merges {
            let text = |place: &&IssueLocation| {
                let text = place.description.strip_prefix(ALSO).unwrap_or_default();
                format!("{text}{}", self.reference(place))
            };
            return joined.iter().map(text).collect();
        }
        let groups = by_shape(joined);
        let shown = match groups.len() > MOST_JOINED + 1 {
            true => MOST_JOINED,
            false => groups.len(),
        };
        let (shown, hidden) = groups.split_at(shown);
        let main = shape(words(main));
        let mut texts: Vec<String> = shown
            .iter()
            .map(|(of, members)| self.group(*of == main, members))
            .collect();
        let hidden: usize = hidden.iter().map(|(_, members)| members.len()).sum();
        if hidden > 0 {
            texts.push(format!("{hidden} more; `--verbose` prints them all"));
        }
        texts
    }

    /// Returns the text of findings that differ only in numbers.
    fn group(&self, is_like_main: bool, members: &[&IssueLocation]) -> String {
        let (Some(first), false) = (members.first(), is_like_main) else {
            return format!("similar findings: {}", self.rows(members));
        };
        let text = first.description.strip_prefix(ALSO).unwrap_or_default();
        let rule = text.rfind(" [").map_or("", |at| &text[at..]);
        let similar = match &members[1..] {
            [] => String::new(),
            others => format!("; similar findings: {}", self.rows(others)),
        };
        format!("{}{rule}{}{similar}", words(text), self.reference(first))
    }

    /// Returns the positions of further places: `rows 7, 9, 12`.
    fn rows(&self, places: &[&IssueLocation]) -> String {
        let shown = if self.merges { MOST_ROWS } else { usize::MAX };
        let name = |place: &&IssueLocation| match (&place.path, place.row) {
            (None, Some(row)) => row.to_string(),
            _ => self.name(place),
        };
        let mut names: Vec<String> = places.iter().map(name).collect();
        names.dedup();
        let word = if names.len() == 1 { "row" } else { "rows" };
        let more = match names.len().saturating_sub(shown) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        names.truncate(shown);
        format!("{word} {}{more}", names.join(", "))
    }

    /// Returns the position of another place in brackets: ` (row 7)`.
    fn reference(&self, place: &IssueLocation) -> String {
        match (&place.path, place.row) {
            (Some(_), _) => format!(" ({})", self.name(place)),
            (None, Some(row)) => format!(" (row {row})"),
            (None, None) => String::new(),
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

/// Groups joined findings that differ only in numbers, in their order.
fn by_shape<'p>(joined: &[&'p IssueLocation]) -> Vec<(String, Vec<&'p IssueLocation>)> {
    let mut groups: Vec<(String, Vec<&IssueLocation>)> = Vec::new();
    for place in joined {
        let text = place.description.strip_prefix(ALSO).unwrap_or_default();
        let shape = shape(words(text));
        match groups.iter_mut().find(|(other, _)| *other == shape) {
            Some((_, members)) => members.push(place),
            None => groups.push((shape, vec![place])),
        }
    }
    groups
}

/// Returns what is wrong, without what is allowed and without the rule.
fn words(text: &str) -> &str {
    let text = text.rsplit_once(" [").map_or(text, |(words, _)| words);
    text.split_once("; ")
        .map_or(text, |(words, _)| words)
        .trim()
}

/// Checks whether a place stands for another finding about the same fault.
fn is_joined(place: &IssueLocation) -> bool {
    place.description.starts_with(ALSO)
}

/// Returns the UIDs of further rules that the same fact violates, without those of joined findings.
fn further_rules(info: &DomainInfo, joined: &[&IssueLocation]) -> String {
    let values = info.content.iter().flat_map(|element| &element.attributes);
    let is_named = |uid: &str| {
        let name = format!("[{}]", rule_name(uid, ""));
        joined.iter().any(|it| it.description.ends_with(&name))
    };
    let uids = values.filter(|(_, uid)| !is_named(uid));
    let uids: Vec<String> = uids.map(|(_, uid)| one_line(uid)).collect();
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

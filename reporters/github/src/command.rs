//! Workflow commands: writes them and prevents untrusted text from becoming one.

use qcbus_formats::xqar::Level;
use qcbus_reporter_sdk::{one_line, rule_name};

use crate::Entry;

/// Largest line or column number that the host accepts.
const LARGEST_NUMBER: u64 = i32::MAX as u64;

/// Returns the command that annotates a place in a file, without a line feed.
pub(crate) fn annotation(entry: &Entry) -> String {
    let mut properties = format!("file={}", property(&entry.path));
    let numbers = [("line", entry.row), ("col", entry.row.and(entry.column))];
    for (name, number) in numbers {
        if let Some(number) = number.filter(|&number| number <= LARGEST_NUMBER) {
            properties.push_str(&format!(",{name}={number}"));
        }
    }
    let title = property(rule_name(&entry.rule, &entry.rule));
    let name = name(entry.level);
    format!("::{name} {properties},title={title}::{}", data(&entry.text))
}

fn name(level: Level) -> &'static str {
    match level {
        Level::Error => "error",
        Level::Warning => "warning",
        Level::Information => "notice",
    }
}

/// Escapes the text after the second `::` of a command.
pub(crate) fn data(text: &str) -> String {
    let escape = |c| match c {
        '%' => Some("%25"),
        '\r' => Some("%0D"),
        '\n' => Some("%0A"),
        _ => None,
    };
    escaped(text, escape)
}

/// Escapes a value between the command's name and the second `::`.
fn property(text: &str) -> String {
    let escape = |c| match c {
        '%' => Some("%25"),
        '\r' => Some("%0D"),
        '\n' => Some("%0A"),
        ':' => Some("%3A"),
        ',' => Some("%2C"),
        _ => None,
    };
    escaped(text, escape)
}

fn escaped(text: &str, escape: impl Fn(char) -> Option<&'static str>) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match escape(c) {
            Some(escape) => out.push_str(escape),
            None => out.push(c),
        }
    }
    out
}

/// Escapes a path for a line of the log. The result has no colon and no two `#` in sequence. So the
/// path ends at the first colon of the line, and no line begins with two colons.
pub(crate) fn place_path(path: &str) -> String {
    let mut out = String::with_capacity(path.len());
    for (c, begins) in beginnings(path) {
        match c {
            '%' => out.push_str("%25"),
            ':' => out.push_str("%3A"),
            '#' if begins => out.push_str("%23"),
            c => out.push(c),
        }
    }
    out
}

/// Returns the text that was passed to [`place_path`] or [`data`].
pub(crate) fn unescaped(text: &str) -> String {
    let mut parts = text.split('%');
    let mut out = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let known = [
            ("25", '%'),
            ("3A", ':'),
            ("23", '#'),
            ("0D", '\r'),
            ("0A", '\n'),
        ];
        let found = known
            .into_iter()
            .find_map(|(code, c)| Some((c, part.strip_prefix(code)?)));
        match found {
            Some((c, rest)) => {
                out.push(c);
                out.push_str(rest);
            }
            None => {
                out.push('%');
                out.push_str(part);
            }
        }
    }
    out
}

/// Returns untrusted text on one line, cut after `most` characters. A sign marks a cut. The
/// beginning of a command of the older form is broken up.
pub(crate) fn tame(text: &str, most: usize) -> String {
    let line = one_line(text);
    let end = line.char_indices().nth(most).map(|(end, _)| end);
    let kept = end.and_then(|end| line.get(..end)).unwrap_or(&line);
    let mut out = String::with_capacity(kept.len());
    for (c, begins) in beginnings(kept) {
        out.push(c);
        if begins {
            out.push(' ');
        }
    }
    if end.is_some() {
        out.push('…');
    }
    out
}

/// Returns the characters, each with a flag for a `#` before another `#`. Non-ASCII characters
/// between them are ignored, because a comparison by the rules of a language may ignore some.
fn beginnings(text: &str) -> impl Iterator<Item = (char, bool)> {
    let mut follower = None;
    let backwards = text.chars().rev().map(move |c| {
        let begins = c == '#' && follower == Some('#');
        if c.is_ascii() {
            follower = Some(c);
        }
        (c, begins)
    });
    let mut marked: Vec<(char, bool)> = backwards.collect();
    marked.reverse();
    marked.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_reserved_by_host_are_escaped() {
        assert_eq!(data("50 %\r\na: b, c"), "50 %25%0D%0Aa: b, c");
        assert_eq!(property("50 %\r\na: b, c"), "50 %25%0D%0Aa%3A b%2C c");
        assert_eq!(unescaped(&data("%25\r\n%0A%")), "%25\r\n%0A%");
    }

    #[test]
    fn path_in_log_is_unescaped_to_original() {
        assert_eq!(place_path("maps/a b,c.xodr"), "maps/a b,c.xodr");
        assert_eq!(place_path("::error::"), "%3A%3Aerror%3A%3A");
        assert_eq!(place_path("##[group]#"), "%23#[group]#");
        for path in ["a%3Ab:c", "%", "%25%", "###[x]:", "#\u{ad}#[", "é%é"] {
            assert_eq!(unescaped(&place_path(path)), path);
        }
    }

    #[test]
    fn adjacent_hashes_are_separated() {
        assert_eq!(tame("a ##[group]x", 99), "a # #[group]x");
        assert_eq!(tame("###", 99), "# # #");
        assert_eq!(tame("#\u{ad}#[error]", 99), "# \u{ad}#[error]");
        assert_eq!(tame("# #[1] road #5", 99), "# #[1] road #5");
        assert_eq!(tame("a\n::error::b\r##", 99), "a ::error::b # #");
        assert_eq!(tame("äöü", 2), "äö…");
    }
}

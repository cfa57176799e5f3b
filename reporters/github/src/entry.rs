//! One line of the log, which may also become an annotation.

use std::fmt;

use qcbus_formats::xqar::Level;

use crate::command::{place_path, unescaped};

/// A statement of a report about a place.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// Severity.
    pub level: Level,
    /// Display path of the file.
    pub path: String,
    /// Line, from 1, if known.
    pub row: Option<u64>,
    /// Column in characters, from 1, if known.
    pub column: Option<u64>,
    /// Text of the finding: one line without any command.
    pub text: String,
    /// UID of the rule, or `bundle/checker`. It has no spaces and is never empty.
    pub rule: String,
}

impl fmt::Display for Entry {
    /// Writes `path:row:column: level: text [rule]`; unknown parts are left out.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&place_path(&self.path))?;
        for number in [self.row, self.row.and(self.column)].iter().flatten() {
            write!(f, ":{number}")?;
        }
        let Entry { text, rule, .. } = self;
        write!(f, ": {}: {text} [{rule}]", self.level.as_str())
    }
}

impl Entry {
    /// Returns the entry of a line, or `None` if the line is not an entry.
    pub(crate) fn read(line: &str) -> Option<Entry> {
        let (place, said) = line.split_once(": ")?;
        let (word, said) = said.split_once(": ")?;
        let (text, rule) = said.strip_suffix(']')?.rsplit_once(" [")?;
        let mut place = place.split(':');
        let path = unescaped(place.next()?);
        let mut number = || place.next().map(str::parse).transpose();
        let (row, column) = (number().ok()?, number().ok()?);
        let level = Level::from_word(word).filter(|level| level.as_str() == word)?;
        Some(Entry {
            level,
            path,
            row,
            column,
            text: text.to_owned(),
            rule: rule.to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry() -> Entry {
        Entry {
            level: Level::Warning,
            path: "a: error: b:3".into(),
            row: Some(3),
            column: Some(u64::MAX),
            text: "1: error: 2 [3".into(),
            rule: "b/c]".into(),
        }
    }

    #[test]
    fn entry_line_parses_back() {
        let known = entry();
        let line = "a%3A error%3A b%3A3:3:18446744073709551615: warning: 1: error: 2 [3 [b/c]]";
        assert_eq!(known.to_string(), line);
        assert_eq!(Entry::read(line), Some(known));
        for unknown in [
            Entry {
                column: None,
                ..entry()
            },
            Entry {
                path: String::new(),
                row: None,
                column: None,
                ..entry()
            },
        ] {
            assert_eq!(Entry::read(&unknown.to_string()), Some(unknown));
        }
    }

    #[test]
    fn foreign_lines_are_not_parsed_as_entries() {
        for line in [
            "",
            "a: error: b",
            "a:x: error: b [c]",
            "a:1: bad: b [c]",
            "a: Error: b [c]",
        ] {
            assert_eq!(Entry::read(line), None, "{line}");
        }
    }
}

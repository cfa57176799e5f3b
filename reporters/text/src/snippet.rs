//! Source line with a caret under the place.

use qcbus_reporter_sdk::{Line, printable, underlined};
use unicode_width::UnicodeWidthChar as _;

/// Number of columns of a tab.
const TAB: usize = 4;

/// Sign for the cut part of a line.
const CUT: char = '…';

/// A displayed line and the position of the marks below it.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Snippet {
    /// The line or the part around the place, limited to the requested width.
    pub(crate) text: String,
    /// Columns before the first mark and number of marks; `None` if the column is unknown.
    pub(crate) marks: Option<(usize, usize)>,
}

/// A character and its width in columns.
type Cell = (char, usize);

/// Returns `line` within `width` columns, so that character `column` (from 1) is visible.
pub(crate) fn snippet(line: &Line, column: Option<u64>, width: usize) -> Snippet {
    let cells: Vec<Cell> = printable(&line.text).chars().map(cell).collect();
    let at = column.map(|column| {
        let before = column.saturating_sub(line.skipped).saturating_sub(1);
        usize::try_from(before).map_or(cells.len(), |before| before.min(cells.len()))
    });
    let chars: Vec<char> = cells.iter().map(|&(c, _)| c).collect();
    let marked = at.map_or(0, |at| underlined(&chars, at));
    let from = at.map_or(0, |at| first_shown(&cells, at, marked, width));
    let cut_left = from > 0 || line.skipped > 0;
    let mut shown = Shown::new(cut_left);
    let mut to = from;
    for &(c, columns) in &cells[from..] {
        let last = to + 1 == cells.len() && !line.goes_on;
        if shown.columns + columns + usize::from(!last) > width {
            break;
        }
        shown.push(c, columns);
        to += 1;
    }
    if to < cells.len() || line.goes_on {
        shown.text.push(CUT);
    }
    let marks = at.map(|at| {
        let before = usize::from(cut_left) + columns(&cells[from..at.max(from)]);
        let end = (at + marked).clamp(at, to.max(at));
        (before.min(width), columns(&cells[at..end]).max(1))
    });
    let text = shown.text.trim_end().to_owned();
    Snippet { text, marks }
}

struct Shown {
    text: String,
    columns: usize,
}

impl Shown {
    fn new(cut_left: bool) -> Shown {
        Shown {
            text: if cut_left { CUT.into() } else { String::new() },
            columns: usize::from(cut_left),
        }
    }

    fn push(&mut self, c: char, columns: usize) {
        if c == '\t' {
            self.text.extend(std::iter::repeat_n(' ', columns));
        } else {
            self.text.push(c);
        }
        self.columns += columns;
    }
}

fn cell(c: char) -> Cell {
    match c {
        '\t' => (c, TAB),
        _ => (c, c.width().unwrap_or(1)),
    }
}

fn columns(cells: &[Cell]) -> usize {
    cells.iter().map(|&(_, columns)| columns).sum()
}

/// Returns the first character to show. It is the first one of the line, unless the place would be
/// cut off at the right. In that case a third of the width is kept before the place.
fn first_shown(cells: &[Cell], at: usize, marked: usize, width: usize) -> usize {
    let end = (at + marked).min(cells.len());
    if columns(cells) <= width || columns(&cells[..end]) + 1 < width {
        return 0;
    }
    let mut from = at;
    let mut before = 0;
    while from > 0 && before + cells[from - 1].1 <= width / 3 {
        from -= 1;
        before += cells[from].1;
    }
    from
}

#[cfg(test)]
mod tests {
    use unicode_width::UnicodeWidthStr as _;

    use super::*;

    /// Returns the line with its marks below it.
    fn show(line: &str, column: u64, width: usize) -> String {
        let snippet = snippet(&Line::from(line), Some(column), width);
        let (before, count) = snippet.marks.unwrap();
        format!(
            "{}\n{}{}",
            snippet.text,
            " ".repeat(before),
            "^".repeat(count)
        )
    }

    #[test]
    fn tags_attributes_and_single_characters_are_marked() {
        assert_eq!(show("  <road id='5'>", 3, 80), "  <road id='5'>\n  ^^^^^");
        assert_eq!(
            show("  <road id='5'>", 9, 80),
            "  <road id='5'>\n        ^^^^^^"
        );
        assert_eq!(show("</road>", 1, 80), "</road>\n^^^^^^");
        assert_eq!(show("a & b", 3, 80), "a & b\n  ^");
    }

    #[test]
    fn tabs_and_wide_characters_move_the_caret() {
        assert_eq!(show("\t<a/>", 2, 80), "    <a/>\n    ^^");
        assert_eq!(
            show("<a n='道路' b='1'/>", 11, 80),
            "<a n='道路' b='1'/>\n            ^^^^^"
        );
        assert_eq!(show("ä\u{308}<b/>", 3, 80), "ä\u{308}<b/>\n ^^");
    }

    #[test]
    fn column_beyond_line_points_past_its_end() {
        assert_eq!(show("<a>", 99, 80), "<a>\n   ^");
        assert_eq!(show("", 1, 80), "\n^");
        assert_eq!(show("<a>", u64::MAX, 80), "<a>\n   ^");
    }

    #[test]
    fn long_line_is_cut_around_the_column() {
        let line = format!("{}<road id='7'>{}", "x".repeat(500), "y".repeat(500));
        let shown = show(&line, 501, 40);
        let text = shown.lines().next().unwrap();
        assert!(text.starts_with("…xxx") && text.ends_with("y…"), "{text}");
        assert!(text.width() <= 40, "{text}");
        assert_eq!(shown.lines().nth(1).unwrap().trim_start(), "^^^^^");
        let caret = shown.lines().nth(1).unwrap().find('^').unwrap();
        assert_eq!(text.chars().nth(caret), Some('<'));
    }

    #[test]
    fn partial_line_is_marked_as_cut_on_both_sides() {
        let line = Line {
            text: "abc <road> def".into(),
            skipped: 1000,
            goes_on: true,
        };
        let shown = snippet(&line, Some(1005), 80);
        assert_eq!(shown.text, "…abc <road> def…");
        assert_eq!(shown.marks, Some((5, 5)));
    }

    #[test]
    fn nothing_is_marked_without_column() {
        assert_eq!(snippet(&Line::from("<a>"), None, 80).marks, None);
    }
}

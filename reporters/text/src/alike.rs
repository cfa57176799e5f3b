//! Groups of findings that differ only in their numbers and places.

use std::collections::HashMap;

use qcbus_formats::xqar::Level;

use crate::Entry;

/// Number of findings up to which a group is shown in full.
const FEW: usize = 3;

/// Number of rows that are named.
const ROWS: usize = 8;

/// For each finding in order: `None` if an earlier one stands for it, else the note about those
/// that it stands for, which may be empty.
pub(crate) fn notes(entries: &[Entry<'_>]) -> Vec<Option<String>> {
    let mut groups: HashMap<(Level, &str, Option<&str>, String), Vec<usize>> = HashMap::new();
    for (number, entry) in entries.iter().enumerate() {
        let issue = entry.issue;
        let key = (
            issue.level,
            issue.rule_uid.as_str(),
            // The named rows are those of one file.
            entry.places.first().and_then(|place| place.path.as_deref()),
            shape(&issue.description),
        );
        groups.entry(key).or_default().push(number);
    }
    let mut notes: Vec<Option<String>> = entries.iter().map(|_| Some(String::new())).collect();
    for members in groups.into_values().filter(|it| it.len() > FEW) {
        let [first, others @ ..] = members.as_slice() else {
            continue;
        };
        for other in others {
            notes[*other] = None;
        }
        notes[*first] = Some(note(entries, others));
    }
    notes
}

/// Returns a text without its numbers.
pub(crate) fn shape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        let is_number = c.is_ascii_digit() || (c == '.' && out.ends_with('#'));
        if !is_number {
            out.push(c);
        } else if !out.ends_with('#') {
            // The sign belongs to the number.
            if out.ends_with('-') {
                out.pop();
            }
            out.push('#');
        }
    }
    out
}

fn note(entries: &[Entry<'_>], others: &[usize]) -> String {
    let rows = others
        .iter()
        .filter_map(|at| entries[*at].places.first()?.row);
    let named: Vec<String> = rows.take(ROWS).map(|row| row.to_string()).collect();
    let places = match named.len() {
        0 => String::new(),
        1 => format!(", in row {}", named[0]),
        count if count < others.len() => {
            let more = others.len() - count;
            format!(", in rows {} and {more} others", named.join(", "))
        }
        _ => format!(", in rows {}", named.join(", ")),
    };
    format!(
        "{} more findings like this{places}; `--verbose` prints them all",
        others.len()
    )
}

#[cfg(test)]
mod tests {
    use super::shape;

    #[test]
    fn texts_of_one_shape_differ_only_in_numbers() {
        assert_eq!(
            shape("lane `-1` of road `17` is up to 3500.0 m wide."),
            shape("lane `2` of road `3` is up to 12.25 m wide.")
        );
        assert_ne!(
            shape("this `width` repeats"),
            shape("this `elevation` repeats")
        );
        assert_ne!(shape("road `a1`"), shape("road `b1`"));
    }
}

//! One line for each finding: `PATH:ROW:COLUMN: LEVEL: TEXT [RULE]`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use qcbus_formats::xqar::Level;
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{one_line, rule_name, silences};

use crate::paint::Paint;
use crate::{Entry, sorted};

/// Maximum number of findings of one rule that are shown for one file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folding {
    /// All findings, for programs.
    None,
    /// This number of findings, followed by a line with the number of further ones.
    After(usize),
}

/// Returns the findings of a result, one per line in the form that editors and CI recognise. If the
/// verdict is undetermined, a line with the reason follows. It is empty for an accepted file
/// without findings.
pub fn concise(result: &ResultMessage, color: bool, folding: Folding) -> String {
    let paint = Paint::new(color);
    let mut out = String::new();
    let mut shown_of: BTreeMap<(Level, &str), usize> = BTreeMap::new();
    let entries = sorted(result);
    for entry in &entries {
        let rule = rule_name(&entry.issue.rule_uid, &entry.checker.id);
        let so_far = shown_of.entry((entry.issue.level, rule)).or_default();
        *so_far += 1;
        if !folding.hides(*so_far) {
            line(&mut out, result, entry, rule, paint);
        }
    }
    for ((level, rule), count) in shown_of {
        if let Some(more) = folding.hidden(count) {
            let path = shown::line(&result.display_path);
            let level = paint.level(level, level.as_str());
            let rule = shown::line(rule);
            let _ = writeln!(
                out,
                "{path}: {level}: and {more} more of this rule [{rule}]"
            );
        }
    }
    if result.verdict == Verdict::Undetermined {
        let path = paint.bold(&shown::line(&result.display_path));
        let word = paint.verdict(result.verdict, result.verdict.as_str());
        let _ = writeln!(out, "{path}: {word}: {}", why(result));
    }
    out
}

impl Folding {
    fn hides(self, number: usize) -> bool {
        matches!(self, Folding::After(most) if number > most)
    }

    fn hidden(self, count: usize) -> Option<usize> {
        match self {
            Folding::None => None,
            Folding::After(most) => count.checked_sub(most).filter(|more| *more > 0),
        }
    }
}

fn line(out: &mut String, result: &ResultMessage, entry: &Entry<'_>, rule: &str, paint: Paint) {
    let place = entry.places.first();
    // A line is about the checked file. For another file it uses the place of the reference.
    let at = place.and_then(|place| match &place.path {
        Some(_) => place.referred_at,
        None => place.row.map(|row| (row, place.column.unwrap_or(0))),
    });
    let at = match at {
        None => String::new(),
        Some((row, 0)) => format!(":{row}"),
        Some((row, column)) => format!(":{row}:{column}"),
    };
    let path = shown::line(&result.display_path);
    let place_name = paint.bold(&format!("{path}{at}"));
    let level = paint.level(entry.issue.level, entry.issue.level.as_str());
    let text = match one_line(&entry.issue.description) {
        text if text.is_empty() => "(no description)".to_owned(),
        text => text,
    };
    let rule = paint.frame(&format!("[{}]", shown::line(rule)));
    let _ = writeln!(out, "{place_name}: {level}: {text} {rule}");
}

/// Returns the reasons for an undetermined verdict.
fn why(result: &ResultMessage) -> String {
    let silences: Vec<String> = silences(result).iter().map(ToString::to_string).collect();
    shown::line(&silences.join("; ")).into_owned()
}

//! One line for each finding: `PATH:ROW:COLUMN: LEVEL: TEXT [RULE]`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use qcbus_formats::xqar::{Checker, Level, Status};
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{checkers, is_open, one_line, reason, rule_name};

use crate::paint::Paint;
use crate::{Entry, sorted};

/// How many findings of one rule are shown of one file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Folding {
    /// All: for programs.
    None,
    /// So many, and a line says how many more there are.
    After(usize),
}

/// The findings of a result on one line each, in the manner that editors and CI recognise, then, when
/// the verdict is undetermined, a line that says why. Empty for an accepted file without findings.
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
    // A line is about the checked file: of what lies in another one, it has where that is referred to.
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

/// Why nobody can say more: the first reason, and how many checkers there are that did not look.
fn why(result: &ResultMessage) -> String {
    let open: Vec<&Checker> = checkers(result)
        .map(|(_, checker)| checker)
        .filter(|it| is_open(it))
        .collect();
    let failed = open.iter().filter(|it| it.status != Some(Status::Skipped));
    let Some(first) = failed.chain(&open).next() else {
        return "nobody has looked".to_owned();
    };
    let reason = reason(first);
    let first = shown::line(&first.id);
    match open.len() {
        1 => format!("{first} did not look: {reason}"),
        many => format!("{many} checkers did not look, such as {first}: {reason}"),
    }
}

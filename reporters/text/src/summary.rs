//! Summary: the verdict, and the checkers by status with the reasons.

use std::fmt::Write as _;

use qcbus_formats::pool::NotAsked;
use qcbus_formats::xqar::{Level, Status};
use qcbus_messages::{Digest, ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{is_inapplicable, reason};

use crate::Options;
use crate::paint::Paint;
use crate::wrap::wrap;

/// Writes the verdict line and the summary.
pub(crate) fn write(out: &mut String, result: &ResultMessage, paint: Paint, options: &Options) {
    let verdict = result.verdict;
    let path = paint.bold(&shown::line(&result.display_path));
    let word = paint.verdict(verdict, verdict.as_str());
    let _ = writeln!(out, "{word}: {path}: {}", issues(result));
    let _ = writeln!(out, "  checkers: {}", checkers(result, options));
    for group in groups(result, options) {
        group.write(out, options);
    }
    let not_asked = NotAsked::of(&result.results);
    if !not_asked.is_empty() {
        let not_asked: Vec<String> = not_asked.iter().map(ToString::to_string).collect();
        let _ = writeln!(
            out,
            "  not requested: {}",
            shown::line(&not_asked.join(", "))
        );
    }
    if result.digest != Digest::default() {
        let _ = writeln!(out, "  sha256: {}", result.digest);
    }
}

/// Returns for example `2 errors, 1 warning`, or `no issues`.
fn issues(result: &ResultMessage) -> String {
    let of = |level: Level| {
        let bundles = result.results.bundles.iter();
        let checkers = bundles.flat_map(|bundle| &bundle.checkers);
        let issues = checkers.flat_map(|checker| &checker.issues);
        issues.filter(|issue| issue.level == level).count()
    };
    let counts = [
        counted(of(Level::Error), "error", "errors"),
        counted(of(Level::Warning), "warning", "warnings"),
        counted(of(Level::Information), "information", "information"),
    ];
    let said: Vec<String> = counts.into_iter().flatten().collect();
    match said.as_slice() {
        [] if result.verdict == Verdict::Undetermined => {
            "no issues, but not all checkers have run".into()
        }
        [] => "no issues".into(),
        _ => said.join(", "),
    }
}

fn counted(count: usize, one: &str, many: &str) -> Option<String> {
    (count > 0).then(|| format!("{count} {}", if count == 1 { one } else { many }))
}

/// Returns the number of checkers by status; `completed` is always included.
fn checkers(result: &ResultMessage, options: &Options) -> String {
    let all = || {
        let bundles = result.results.bundles.iter();
        bundles.flat_map(|bundle| &bundle.checkers)
    };
    let of = |status| all().filter(|checker| checker.status == status).count();
    let skipped = of(Some(Status::Skipped));
    let inapplicable = all().filter(|checker| is_inapplicable(checker)).count();
    let skips = match (options.inapplicable, inapplicable) {
        (true, _) | (_, 0) => "skipped".to_owned(),
        (false, all) if all == skipped => "skipped that do not apply to the file".to_owned(),
        (false, some) => format!("skipped, {some} of which do not apply to the file"),
    };
    let rest = [
        (skipped, skips.as_str()),
        (of(Some(Status::Error)), "gave no answer"),
        (of(None), "without a status"),
    ];
    let mut text = format!("{} completed", of(Some(Status::Completed)));
    for (count, word) in rest.into_iter().filter(|&(count, _)| count > 0) {
        let _ = write!(text, ", {count} {word}");
    }
    text
}

/// Returns lines about checkers that failed or were blocked.
pub(crate) fn not_looked(result: &ResultMessage, options: &Options, blocked: bool) -> String {
    let options = Options {
        inapplicable: false,
        ..*options
    };
    let mut out = String::new();
    for group in groups(result, &options) {
        if blocked || group.status == Status::Error {
            group.write(&mut out, &options);
        }
    }
    out
}

/// Checkers with the same status for the same reason. For example, all semantic checkers are
/// skipped if a file is not well-formed, and one line reports them.
struct Group {
    status: Status,
    reason: String,
    checkers: Vec<String>,
}

impl Group {
    fn write(&self, out: &mut String, options: &Options) {
        let width = options.width;
        let word = match self.status {
            Status::Skipped => "skipped",
            Status::Completed | Status::Error => "gave no answer",
        };
        let head = format!("{word}, {}: {}", self.checkers.len(), self.reason);
        for (number, line) in wrap(&head, width.saturating_sub(6)).iter().enumerate() {
            let _ = writeln!(out, "  {}{line}", if number == 0 { "" } else { "    " });
        }
        // On a terminal, a few names are enough.
        let most = match self.status {
            Status::Skipped => options.skipped_names,
            Status::Completed | Status::Error => options.failed_names,
        };
        let mut names = self
            .checkers
            .iter()
            .take(most)
            .cloned()
            .collect::<Vec<_>>()
            .join(" ");
        let rest = self.checkers.len().saturating_sub(most);
        if rest > 0 {
            let _ = write!(names, " and {rest} more");
        }
        for line in wrap(&names, width.saturating_sub(6)) {
            let _ = writeln!(out, "      {line}");
        }
    }
}

/// Returns the groups that did not complete; failed groups come before skipped ones.
fn groups(result: &ResultMessage, options: &Options) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for bundle in &result.results.bundles {
        for checker in &bundle.checkers {
            let Some(status @ (Status::Error | Status::Skipped)) = checker.status else {
                continue;
            };
            if is_inapplicable(checker) && !options.inapplicable {
                continue;
            }
            let name = shown::line(&format!("{}/{}", bundle.name, checker.id)).into_owned();
            let reason = reason(checker);
            let known = groups
                .iter_mut()
                .find(|group| group.status == status && group.reason == reason);
            match known {
                Some(group) => group.checkers.push(name),
                None => groups.push(Group {
                    status,
                    reason,
                    checkers: vec![name],
                }),
            }
        }
    }
    if !options.inapplicable {
        groups = by_cause(groups);
    }
    groups.sort_by_key(|group| group.status != Status::Error);
    groups
}

/// Merges checkers that wait for a skipped checker into the group of that skipped checker.
fn by_cause(groups: Vec<Group>) -> Vec<Group> {
    let mut merged: Vec<Group> = Vec::new();
    for group in groups {
        let waits_for = group.reason.strip_suffix("` was skipped.");
        let waits_for = waits_for.and_then(|rest| rest.strip_prefix('`'));
        let stopped = waits_for.and_then(|id| {
            let is_it = |name: &String| name.rsplit('/').next() == Some(id);
            let mut earlier = merged.iter_mut();
            earlier.find(|other| other.status == group.status && other.checkers.iter().any(is_it))
        });
        match stopped {
            Some(other) => other.checkers.extend(group.checkers),
            None => merged.push(group),
        }
    }
    merged
}

//! Summary of a run: counts of verdicts, findings and rules.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use qcbus_formats::pool::NotAsked;
use qcbus_formats::xqar::Level;
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{checkers, is_blocked, not_listed, rule_name};

/// Number of rules that the summary lists without `--statistics`.
const FIRST: usize = 5;

/// Number of findings from which the summary says what to fix first.
const MANY: usize = 30;

/// Counts over all files of a run.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Number of files by verdict, in the order of [`Verdict`].
    verdicts: BTreeMap<Verdict, usize>,
    /// Number of findings by level.
    levels: BTreeMap<Level, usize>,
    /// Number of files with findings, by the worst level of each file.
    files_at: BTreeMap<Level, usize>,
    rules: BTreeMap<(Level, String), RuleCount>,
    /// Number of checkers that could not run in files with errors, and number of those files.
    blocked: (usize, usize),
    /// Number of findings that are counted but not listed.
    not_listed: u64,
    /// The first few undetermined files.
    open: Vec<String>,
    /// Checks that configuration or command line left out, by bundle. They are the same for every
    /// file.
    left_out: BTreeMap<String, NotAsked>,
}

/// Findings of one rule.
#[derive(Debug)]
struct RuleCount {
    findings: usize,
    files: usize,
    about: String,
}

impl Tally {
    /// Adds the result of a file.
    pub(super) fn add(&mut self, result: &ResultMessage) {
        *self.verdicts.entry(result.verdict).or_default() += 1;
        let (mut worst, mut seen, mut blocked) = (None, BTreeSet::new(), 0);
        for (_, checker) in checkers(result) {
            blocked += usize::from(is_blocked(checker));
            for issue in &checker.issues {
                let name = rule_name(&issue.rule_uid, &checker.id).to_owned();
                *self.levels.entry(issue.level).or_default() += 1;
                worst = worst.min(Some(issue.level)).or(Some(issue.level));
                let key = (issue.level, name);
                let rule = self.rules.entry(key.clone()).or_insert(RuleCount {
                    findings: 0,
                    files: 0,
                    about: checker.description.to_string(),
                });
                rule.findings += 1;
                rule.files += usize::from(seen.insert(key));
            }
        }
        if let Some(worst) = worst {
            *self.files_at.entry(worst).or_default() += 1;
        }
        if blocked > 0 && result.verdict == Verdict::Rejected {
            self.blocked = (self.blocked.0 + blocked, self.blocked.1 + 1);
        }
        if result.verdict == Verdict::Undetermined && self.open.len() < FIRST {
            self.open.push(result.display_path.clone());
        }
        self.not_listed = self.not_listed.saturating_add(not_listed(result));
        for left_out in NotAsked::of(&result.results) {
            self.left_out.insert(left_out.bundle.clone(), left_out);
        }
    }

    /// Adds only a verdict: the result contains nothing else or could not be read back.
    pub(super) fn add_verdict(&mut self, verdict: Verdict) {
        *self.verdicts.entry(verdict).or_default() += 1;
    }

    /// Returns the number of files with a verdict.
    pub(super) fn total(&self) -> usize {
        self.verdicts.values().sum()
    }

    /// Returns the number of files with this verdict.
    pub(super) fn count(&self, verdict: Verdict) -> usize {
        self.verdicts.get(&verdict).copied().unwrap_or(0)
    }

    /// Returns the first few undetermined files and the number of further ones.
    pub(super) fn open_files(&self) -> String {
        let named = self.open.join(", ");
        match self
            .count(Verdict::Undetermined)
            .saturating_sub(self.open.len())
        {
            0 => named,
            more => format!("{named} and {more} more"),
        }
    }

    /// Returns all verdicts, one per file.
    pub(super) fn verdicts(&self) -> impl Iterator<Item = Verdict> {
        let each = self.verdicts.iter();
        each.flat_map(|(verdict, count)| std::iter::repeat_n(*verdict, *count))
    }

    /// Returns the number of files with a finding of this level or a worse one.
    pub(super) fn files_from(&self, level: Level) -> usize {
        self.files_at.range(..=level).map(|(_, files)| files).sum()
    }

    /// Returns the summary line:
    /// `28 errors, 9 warnings in 13 of 28 files; 15 accepted, 13 rejected`.
    pub(super) fn line(&self) -> String {
        let level = |level, one: &str, many: &str| {
            let count = self.levels.get(&level).copied().unwrap_or(0);
            format!("{count} {}", if count == 1 { one } else { many })
        };
        let mut line = level(Level::Error, "error", "errors");
        let _ = write!(line, ", {}", level(Level::Warning, "warning", "warnings"));
        if let Some(count) = self.levels.get(&Level::Information) {
            let _ = write!(line, ", {count} information");
        }
        if self.not_listed > 0 {
            let _ = write!(line, " and {} more that are not listed", self.not_listed);
        }
        let (some, total) = (self.files_from(Level::Information), self.total());
        let files = if total == 1 { "file" } else { "files" };
        let _ = write!(line, " in {some} of {total} {files};");
        let verdicts = [Verdict::Accepted, Verdict::Rejected, Verdict::Undetermined];
        let said = verdicts.map(|verdict| (verdict, self.count(verdict)));
        let said = said.iter().filter(|(_, count)| *count > 0);
        let said: Vec<String> = said.map(|(it, count)| format!("{count} {it}")).collect();
        let _ = write!(line, " {}", said.join(", "));
        line
    }

    /// Returns sentences about checks that did not run although they could have.
    pub(super) fn not_looked(&self) -> Vec<String> {
        let mut said = Vec::new();
        let (checks, files) = self.blocked;
        if checks > 0 {
            let files = match files {
                1 => "1 file".to_owned(),
                files => format!("{files} files"),
            };
            said.push(format!(
                "{checks} checks of {files} could not run because of errors above; fix them and check again"
            ));
        }
        if !self.left_out.is_empty() {
            let left_out: Vec<String> = self.left_out.values().map(ToString::to_string).collect();
            said.push(format!(
                "not requested, so the verdicts do not cover it: {}",
                shown::line(&left_out.join(", "))
            ));
        }
        said
    }

    /// Returns the violated rules, ordered by how much a fix helps: errors before warnings, then by
    /// files, then by findings.
    fn ranked(&self) -> Vec<Row<'_>> {
        let mut rules: Vec<Row<'_>> = self.rules.iter().collect();
        rules.sort_by_key(|((level, _), it)| (*level, Reverse(it.files), Reverse(it.findings)));
        rules
    }

    /// Returns the first few rules to fix if a run has many findings.
    pub(super) fn first(&self) -> Option<String> {
        let findings: usize = self.levels.values().sum();
        let errors = self.levels.contains_key(&Level::Error);
        if findings < MANY || self.total() < 2 || !errors {
            return None;
        }
        let ranked = self.ranked();
        let first = ranked
            .iter()
            .filter(|((level, _), _)| *level == Level::Error);
        Some(format!("fix first:\n{}", table(first.take(FIRST))))
    }

    /// Returns all violated rules, the most frequent first.
    pub(super) fn statistics(&self) -> String {
        let mut rules = self.ranked();
        rules.sort_by_key(|(_, it)| Reverse(it.findings));
        if rules.is_empty() {
            return String::new();
        }
        format!("findings by rule:\n{}", table(rules.iter()))
    }
}

/// A rule at one level, and how often it was violated.
type Row<'t> = (&'t (Level, String), &'t RuleCount);

/// Formats rows of findings, files, level, rule and description of the rule.
fn table<'t>(rules: impl Iterator<Item = &'t Row<'t>>) -> String {
    let rows: Vec<_> = rules.collect();
    let names = rows.iter().map(|((_, name), _)| name.chars().count());
    let width = names.max().unwrap_or(0).min(50);
    let mut out = String::new();
    for ((level, name), it) in rows {
        let files = if it.files == 1 { "file" } else { "files" };
        let count = format!("{} in {} {files}", it.findings, it.files);
        let (level, name) = (level.as_str(), shown::line(name));
        let about = shown::line(it.about.split(". ").next().unwrap_or(&it.about));
        let about = about.trim_end_matches('.');
        let _ = writeln!(out, "  {count:>16}  {level:<11}  {name:<width$}  {about}");
    }
    out
}

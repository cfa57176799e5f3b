//! What a run comes to.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use qcbus_formats::pool::NotAsked;
use qcbus_formats::xqar::Level;
use qcbus_messages::{ResultMessage, Verdict, shown};
use qcbus_reporter_sdk::{checkers, is_blocked, not_listed, rule_name};

/// Rules that are named at the end of a run without `--statistics`.
const FIRST: usize = 5;

/// From so many findings on, the end of a run says what to mend first.
const MANY: usize = 30;

/// Counts over all files of a run.
#[derive(Debug, Default)]
pub(super) struct Tally {
    /// Verdicts in the order of [`Verdict`].
    verdicts: BTreeMap<Verdict, usize>,
    /// Findings by level.
    levels: BTreeMap<Level, usize>,
    /// Files with findings of any level, and the worst of each.
    files_at: BTreeMap<Level, usize>,
    rules: BTreeMap<(Level, String), RuleCount>,
    /// Checkers that were kept from looking in files that have errors, and the number of those files.
    blocked: (usize, usize),
    /// Findings that are counted and not listed.
    not_listed: u64,
    /// Files that are undetermined, the first few.
    open: Vec<String>,
    /// What configuration or command line left out, by bundle: the same for every file.
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
    /// Counts a file.
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

    /// A file whose result says nothing beside its verdict, or could not be read back.
    pub(super) fn add_verdict(&mut self, verdict: Verdict) {
        *self.verdicts.entry(verdict).or_default() += 1;
    }

    /// Files with a verdict.
    pub(super) fn total(&self) -> usize {
        self.verdicts.values().sum()
    }

    /// Files with this verdict.
    pub(super) fn count(&self, verdict: Verdict) -> usize {
        self.verdicts.get(&verdict).copied().unwrap_or(0)
    }

    /// The files that are undetermined: the first few, and how many more.
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

    /// The verdicts, each as often as it was given.
    pub(super) fn verdicts(&self) -> impl Iterator<Item = Verdict> {
        let each = self.verdicts.iter();
        each.flat_map(|(verdict, count)| std::iter::repeat_n(*verdict, *count))
    }

    /// Files with a finding of this level or a worse one.
    pub(super) fn files_from(&self, level: Level) -> usize {
        self.files_at.range(..=level).map(|(_, files)| files).sum()
    }

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

    /// What was not looked at although it might have been, in sentences.
    pub(super) fn not_looked(&self) -> Vec<String> {
        let mut said = Vec::new();
        let (checks, files) = self.blocked;
        if checks > 0 {
            let files = match files {
                1 => "1 file".to_owned(),
                files => format!("{files} files"),
            };
            said.push(format!(
                "{checks} checks of {files} could not run because of errors above; mend those and check again"
            ));
        }
        if !self.left_out.is_empty() {
            let left_out: Vec<String> = self.left_out.values().map(ToString::to_string).collect();
            said.push(format!(
                "not asked, so the verdicts say nothing about it: {}",
                shown::line(&left_out.join(", "))
            ));
        }
        said
    }

    /// The rules that were broken, those first whose mending helps most: errors before warnings, then
    /// by files, then by findings.
    fn ranked(&self) -> Vec<Row<'_>> {
        let mut rules: Vec<Row<'_>> = self.rules.iter().collect();
        rules.sort_by_key(|((level, _), it)| (*level, Reverse(it.files), Reverse(it.findings)));
        rules
    }

    /// What to mend first, when there is so much that a person cannot see it: the first few rules.
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

    /// All rules that were broken, the most frequent first.
    pub(super) fn statistics(&self) -> String {
        let mut rules = self.ranked();
        rules.sort_by_key(|(_, it)| Reverse(it.findings));
        if rules.is_empty() {
            return String::new();
        }
        format!("findings by rule:\n{}", table(rules.iter()))
    }
}

/// A rule at one level, and how often it was broken.
type Row<'t> = (&'t (Level, String), &'t RuleCount);

/// Rows of findings, files, level, rule and what it is about.
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

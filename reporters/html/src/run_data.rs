//! Data of the page of a run, as `docs/html-report.md` describes it.

use std::collections::{BTreeMap, HashMap};

use qcbus_formats::xqar::Level;
use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{checkers, one_line, silences};
use serde::{Deserialize, Serialize};

use crate::result_data::{ResultData, RuleData, generator};

/// Maximum number of findings on the page of a run; the pages of the results have the others.
pub(crate) const MOST_FINDINGS: usize = 20_000;

/// A checked file on the page of a run.
#[derive(Serialize, Deserialize, Clone, PartialEq)]
pub(crate) struct FileRow {
    path: String,
    verdict: String,
    /// Path of the result page relative to the run page; empty if there is no result page.
    page: String,
    error: usize,
    warning: usize,
    information: usize,
    why: String,
}

/// A finding of one file.
#[derive(Serialize, Deserialize, Clone, PartialEq)]
struct FindingRow {
    file: usize,
    level: String,
    rule: i64,
    text: String,
    row: Option<u64>,
    column: Option<u64>,
    id: u64,
}

/// All data on the page of a run.
#[derive(Serialize, Deserialize)]
pub(crate) struct RunData {
    schema: u32,
    generator: String,
    title: String,
    made: String,
    files: Vec<FileRow>,
    rules: Vec<RuleData>,
    findings: Vec<FindingRow>,
    cuts: Vec<String>,
}

/// The part of one result on the page of a run.
#[derive(Clone, PartialEq)]
pub(crate) struct Section {
    entry: FileRow,
    findings: Vec<(FindingRow, Option<RuleData>)>,
}

impl Section {
    /// Returns the section of a result. `page` is the link from the run page to the result page.
    pub(crate) fn of(result: &ResultMessage, data: &ResultData<'_>, page: String) -> Section {
        let count = |level: Level| {
            let issues = checkers(result).flat_map(|(_, checker)| &checker.issues);
            issues.filter(|issue| issue.level == level).count()
        };
        let finding = |it: &crate::result_data::FindingData| {
            let place = it.places.first();
            let rule = usize::try_from(it.rule).ok();
            let rule = rule.and_then(|index| data.rules.get(index)).cloned();
            let finding = FindingRow {
                file: 0,
                level: it.level.to_owned(),
                rule: -1,
                text: it.text.clone(),
                row: place.and_then(|place| place.row),
                column: place.and_then(|place| place.column),
                id: it.id,
            };
            (finding, rule)
        };
        Section {
            entry: FileRow {
                path: one_line(&result.display_path),
                verdict: result.verdict.as_str().to_owned(),
                page,
                error: count(Level::Error),
                warning: count(Level::Warning),
                information: count(Level::Information),
                why: why(result),
            },
            findings: data.findings.iter().map(finding).collect(),
        }
    }
}

/// Returns the reasons for an undetermined verdict.
fn why(result: &ResultMessage) -> String {
    let silences: Vec<String> = silences(result).iter().map(ToString::to_string).collect();
    silences.join("; ")
}

impl RunData {
    /// Returns the data of the page for these sections, in the order of their paths.
    pub(crate) fn of(title: &str, sections: &BTreeMap<String, Section>) -> RunData {
        let mut rules = Rules::default();
        let mut all: Vec<(usize, &FindingRow, Option<&RuleData>)> = Vec::new();
        for (file, section) in sections.values().enumerate() {
            let findings = section.findings.iter();
            all.extend(findings.map(|(finding, rule)| (file, finding, rule.as_ref())));
        }
        let total = all.len();
        // The sort is stable, so findings of one level stay in the order of files and places.
        all.sort_by_key(|(_, finding, _)| Level::from_word(&finding.level));
        all.truncate(MOST_FINDINGS);
        let findings = all.into_iter().map(|(file, finding, rule)| FindingRow {
            file,
            rule: rule.map_or(-1, |rule| rules.index(rule)),
            ..finding.clone()
        });
        let findings = findings.collect();
        let mut cuts = Vec::new();
        if total > MOST_FINDINGS {
            let left_out = total - MOST_FINDINGS;
            cuts.push(format!(
                "the {left_out} least severe of {total} findings are not on this page; the pages of the files \
                 contain them"
            ));
        }
        RunData {
            schema: 1,
            generator: generator(),
            title: title.to_owned(),
            made: String::new(),
            files: sections.values().map(|it| it.entry.clone()).collect(),
            rules: rules.list,
            findings,
            cuts,
        }
    }

    /// Returns the sections of a page that was written earlier, by their paths.
    pub(crate) fn into_sections(self) -> BTreeMap<String, Section> {
        let rules = self.rules;
        let mut sections: Vec<Section> = self
            .files
            .into_iter()
            .map(|entry| Section {
                entry,
                findings: Vec::new(),
            })
            .collect();
        for finding in self.findings {
            let rule = usize::try_from(finding.rule).ok();
            let rule = rule.and_then(|index| rules.get(index)).cloned();
            if let Some(section) = sections.get_mut(finding.file) {
                section.findings.push((finding, rule));
            }
        }
        let keyed = sections.into_iter().map(|it| (it.entry.path.clone(), it));
        keyed.collect()
    }
}

/// List of rules without duplicates.
#[derive(Default)]
struct Rules {
    list: Vec<RuleData>,
    known: HashMap<(String, String), usize>,
}

impl Rules {
    fn index(&mut self, rule: &RuleData) -> i64 {
        let key = (rule.uid.clone(), rule.checker.clone());
        let list = &mut self.list;
        let index = *self.known.entry(key).or_insert_with(|| {
            list.push(rule.clone());
            list.len() - 1
        });
        i64::try_from(index).unwrap_or(-1)
    }
}

//! Conversion of sections into one log, and back.

use std::collections::BTreeMap;

use qcbus_messages::ResultMessage;
use qcbus_reporter_sdk::{Destination, Pages, Repeats, ReportError, ReportFormat, Sources};

use crate::finding::plain;
use crate::limits;
use crate::log::{
    Artifact, Base, Driver, Found, Invocation, Location, Log, Notification, ROOT, Rule, Run,
    RunProperties, SCHEMA, SarifResult, Tool,
};
use crate::rules::rules;
use crate::section::{RuleNote, Section};

/// Name of the tool; it identifies a log of qcbus.
const TOOL: &str = "qcbus";

/// Results as SARIF.
#[derive(Debug, Clone, Copy)]
pub struct Sarif {
    pages: Pages,
}

impl Sarif {
    /// Creates a format with these rule pages.
    pub fn new(pages: Pages) -> Sarif {
        Sarif { pages }
    }
}

impl ReportFormat for Sarif {
    type Section = Section;
    const SUFFIX: &'static str = "sarif";

    fn section(
        &self,
        result: &ResultMessage,
        _: &dyn Sources,
        _: Destination,
    ) -> Result<Section, ReportError> {
        Ok(Section::of(result))
    }

    fn whole(&self, sections: &BTreeMap<String, Section>) -> Result<String, ReportError> {
        let mut findings = by_importance(sections);
        let around = written(self.run(sections, &findings))?;
        let fitting = limits::fitting(&findings, around.as_bytes())?;
        findings.truncate(fitting);
        let mut run = self.run(sections, &findings);
        let rules = run.tool.driver.rules.iter().map(|rule| rule.id.clone());
        let places: BTreeMap<String, usize> = rules.zip(0..).collect();
        for finding in &mut findings {
            finding.rule_index = places.get(&finding.rule_id).copied();
        }
        run.results = findings;
        written(run)
    }

    fn split(&self, text: &str) -> BTreeMap<String, Section> {
        let Ok(log) = serde_json::from_str::<Log>(text) else {
            return BTreeMap::new();
        };
        let ours = log
            .runs
            .into_iter()
            .filter(|run| run.tool.driver.name == TOOL);
        ours.flat_map(sections_of).collect()
    }
}

impl Sarif {
    /// Returns the run for these findings, without the findings themselves.
    fn run(&self, sections: &BTreeMap<String, Section>, findings: &[SarifResult]) -> Run {
        let artifacts = || sections.values().map(|section| &section.artifact);
        let found = artifacts().map(|artifact| artifact.properties.found);
        let found = found.fold(Found::default(), Found::plus);
        let left_out = found.minus(Found::of(findings));
        let version = env!("CARGO_PKG_VERSION").to_owned();
        Run {
            tool: Tool {
                driver: Driver {
                    name: TOOL.to_owned(),
                    semantic_version: version.clone(),
                    version,
                    rules: rules(sections.values(), findings, self.pages),
                },
            },
            invocations: vec![Invocation {
                execution_successful: artifacts().all(|it| it.properties.answered),
                tool_execution_notifications: notifications(sections),
                tool_configuration_notifications: limits::notifications(found, left_out),
            }],
            original_uri_base_ids: BTreeMap::from([(ROOT.to_owned(), base())]),
            artifacts: artifacts().cloned().collect(),
            column_kind: "unicodeCodePoints".to_owned(),
            results: Vec::new(),
            properties: RunProperties {
                found: found.total(),
                left_out,
            },
        }
    }
}

fn base() -> Base {
    let text = "The directory that was given or watched; for hosts, the root of the repository.";
    Base {
        description: plain(text),
    }
}

/// Returns the log of a run on one line, because hosts limit the number of bytes.
fn written(run: Run) -> Result<String, ReportError> {
    let log = Log {
        schema: SCHEMA.to_owned(),
        version: "2.1.0".to_owned(),
        runs: vec![run],
    };
    let text = serde_json::to_string(&log);
    let text = text.map_err(|error| ReportError::Form(error.to_string()))?;
    Ok(text + "\n")
}

/// Returns the findings of all sections: the most severe first, then by file. So the first findings
/// stay the same for any host limit, unless more severe findings are added or removed.
fn by_importance(sections: &BTreeMap<String, Section>) -> Vec<SarifResult> {
    let mut repeats = Repeats::default();
    let mut findings = Vec::new();
    for (index, section) in sections.values().enumerate() {
        for finding in &section.findings {
            let mut finding = finding.clone();
            set_artifact(&mut finding.locations, Some(index));
            findings.push(finding);
        }
    }
    findings.sort_by_key(|finding| finding.level);
    for finding in &mut findings {
        let hash = &mut finding.partial_fingerprints.primary_location_line_hash;
        let number = repeats.number(hash);
        *hash = format!("{hash}:{number}");
    }
    findings
}

fn notifications(sections: &BTreeMap<String, Section>) -> Vec<Notification> {
    let mut told = Vec::new();
    for (index, section) in sections.values().enumerate() {
        for notification in &section.notifications {
            let mut notification = notification.clone();
            set_artifact(&mut notification.locations, Some(index));
            told.push(notification);
        }
    }
    told
}

fn set_artifact(locations: &mut [Location], index: Option<usize>) {
    if let Some(location) = locations.first_mut() {
        location.physical_location.artifact_location.index = index;
    }
}

/// Returns the index of the checked file of a finding or a notification.
fn artifact_of(locations: &[Location]) -> Option<usize> {
    let location = locations.first()?;
    location.physical_location.artifact_location.index
}

/// Splits the result of [`ReportFormat::whole`] into its sections.
fn sections_of(run: Run) -> BTreeMap<String, Section> {
    let notes: BTreeMap<String, RuleNote> = run.tool.driver.rules.into_iter().map(note).collect();
    let mut sections: Vec<Section> = run.artifacts.into_iter().map(bare).collect();
    for mut finding in run.results {
        let Some(section) =
            artifact_of(&finding.locations).and_then(|index| sections.get_mut(index))
        else {
            continue;
        };
        if let Some((id, note)) = notes.get_key_value(&finding.rule_id) {
            section.rules.insert(id.clone(), note.clone());
        }
        set_artifact(&mut finding.locations, None);
        finding.rule_index = None;
        let hash = &mut finding.partial_fingerprints.primary_location_line_hash;
        if let Some((bare, _)) = hash.rsplit_once(':') {
            *hash = bare.to_owned();
        }
        section.findings.push(finding);
    }
    let told = run.invocations.into_iter();
    for mut notification in told.flat_map(|it| it.tool_execution_notifications) {
        let index = artifact_of(&notification.locations);
        set_artifact(&mut notification.locations, None);
        if let Some(section) = index.and_then(|index| sections.get_mut(index)) {
            section.notifications.push(notification);
        }
    }
    let key = |section: Section| (section.artifact.properties.path.clone(), section);
    sections.into_iter().map(key).collect()
}

fn bare(artifact: Artifact) -> Section {
    Section {
        artifact,
        findings: Vec::new(),
        notifications: Vec::new(),
        rules: BTreeMap::new(),
    }
}

fn note(rule: Rule) -> (String, RuleNote) {
    let note = RuleNote {
        checker: rule.properties.checker,
        about: rule.short_description.text,
    };
    (rule.id, note)
}

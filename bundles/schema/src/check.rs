//! The bodies of the two schema rules.

use std::collections::HashSet;
use std::sync::Arc;

use qcbus_document::{Document, FileKind};

use crate::later::{Later, is_strange, later};
use crate::model::Schema;
use crate::validate::Overlay;
use crate::versions::{SHIPPED, SkipReason, Version, select, version_of};
use crate::violation::{Limits, Report, Rest, Violation};

/// A user schema that replaces the shipped one.
#[derive(Clone, Debug)]
pub struct Override {
    /// Kind of file that it applies to.
    pub kind: FileKind,
    /// Header version that it applies to. `None` means every version and headers without a version.
    pub version: Option<Version>,
    /// Compiled tables.
    pub schema: Arc<Schema>,
    /// Files from which it was made.
    pub sources: Arc<[Source]>,
}

/// A source file of a schema.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Its path.
    pub path: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// Options of a check.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Limits on the number of listed violations.
    pub limits: Limits,
    /// The user's schemas. The first one that applies is used.
    pub overrides: Vec<Override>,
}

/// Severity of a violation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The file breaks its schema.
    Error,
    /// The file breaks its schema at a known defect of the schema, or its version has no known
    /// schema.
    Information,
}

/// Outcome of a check for one document.
#[derive(Debug)]
pub enum Outcome<'a> {
    /// No schema applies.
    Skipped(SkipReason),
    /// The document was validated.
    Checked(Checked<'a>),
}

/// A validated document.
#[derive(Debug)]
pub struct Checked<'a> {
    /// Title of the schema, e.g. `OpenDRIVE 1.7`.
    pub schema: String,
    /// Files of a user schema. Empty for a shipped schema.
    pub sources: Arc<[Source]>,
    /// Version in the header.
    pub version: Option<Version>,
    /// Whether that version is newer than the newest known schema. That schema is used then.
    pub newer: bool,
    /// Features of later versions that the document uses. Many violations have this one cause.
    /// Violations that the later version allows are left out of the list.
    pub later: Option<Later<'a>>,
    /// The violations in order of discovery.
    pub violations: Vec<Violation<'a>>,
    /// Violations beyond the limits, counted by kind.
    pub rest: Vec<Rest>,
}

/// A fact about the check itself for the result.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// Key of the fact.
    pub key: &'static str,
    /// Value of the fact.
    pub value: String,
    /// Description of the fact.
    pub description: &'static str,
}

impl Checked<'_> {
    /// Returns the schema that was used: a shipped one, or the user's files.
    pub fn provenance(&self) -> Vec<Fact> {
        let fact = |value, description| Fact {
            key: "qcbus.schema",
            value,
            description,
        };
        if self.sources.is_empty() {
            return vec![fact(
                self.schema.clone(),
                "schema that was used to check the file; shipped with qcbus",
            )];
        }
        let files = self.sources.iter();
        files
            .map(|file| {
                fact(
                    format!("{} sha256:{}", file.path, file.sha256),
                    "file of the schema that was used to check the file; given by the user",
                )
            })
            .collect()
    }

    /// Returns the severity of unlisted violations of one kind.
    pub fn severity_of_rest(&self, rest: &Rest) -> Severity {
        match rest.known_schema_defect {
            _ if self.newer => Severity::Information,
            true => Severity::Information,
            false => Severity::Error,
        }
    }

    /// Returns the severity of a violation.
    pub fn severity(&self, violation: &Violation<'_>) -> Severity {
        match violation.known_schema_defect {
            _ if self.newer => Severity::Information,
            Some(_) => Severity::Information,
            None => Severity::Error,
        }
    }
}

/// Validates a document against the schema for its header.
pub fn check<'a>(document: &Document<'a>, kind: FileKind, options: &Options) -> Outcome<'a> {
    if !document.is_well_formed() {
        return Outcome::Skipped(SkipReason::IllFormed);
    }
    let version = version_of(document, kind);
    let own = options
        .overrides
        .iter()
        .find(|one| same_kind(one.kind, kind) && (one.version.is_none() || one.version == version));
    if let Some(own) = own {
        return Outcome::Checked(checked(
            document,
            kind,
            options,
            (&own.schema, own.sources.clone()),
            (version, false),
        ));
    }
    let Some(version) = version else {
        return Outcome::Skipped(SkipReason::NoVersion);
    };
    match select(kind, version) {
        Ok(chosen) => Outcome::Checked(checked(
            document,
            kind,
            options,
            (chosen.schema, Arc::default()),
            (Some(version), chosen.newer),
        )),
        Err(reason) => Outcome::Skipped(reason),
    }
}

/// Checks whether two kinds use one schema. Archives use the schema of their main file.
fn same_kind(one: FileKind, other: FileKind) -> bool {
    (one == FileKind::Xodr) == (other == FileKind::Xodr)
}

fn checked<'a>(
    document: &Document<'a>,
    kind: FileKind,
    options: &Options,
    (schema, sources): (&Schema, Arc<[Source]>),
    (version, newer): (Option<Version>, bool),
) -> Checked<'a> {
    let overlay = if kind != FileKind::Xodr && is_modular(document) {
        Overlay::ModularScenario
    } else {
        Overlay::None
    };
    let report = schema.validate_with(document, options.limits, overlay);
    let is_own = sources.is_empty() && !newer && !report.is_valid();
    let mut later = version
        .filter(|_| is_own)
        .and_then(|version| later(document, kind, version, &report));
    if let Some(later) = &mut later {
        later.advice = best(later, &report, kind, |schema| {
            schema.validate_with(document, options.limits, overlay)
        });
    }
    let Report { violations, rest } = match &later {
        None => report,
        Some(later) if kind == FileKind::Xodr => without(later, report),
        Some(later) => match select(kind, later.version) {
            Err(_) => report,
            Ok(meant) => {
                let schema = meant.schema;
                left_by(
                    &report,
                    schema.validate_with(document, options.limits, overlay),
                )
            }
        },
    };
    Checked {
        schema: schema.title.to_string(),
        sources,
        version,
        newer,
        later,
        violations,
        rest,
    }
}

/// Returns the version with the fewest violations among those that have the later features, if it
/// has no more of them than the report for the header's version. The first such version counts.
fn best<'a>(
    later: &Later<'_>,
    stated: &Report<'a>,
    kind: FileKind,
    validate: impl Fn(&Schema) -> Report<'a>,
) -> Option<Version> {
    let tried = SHIPPED
        .iter()
        .filter(|one| same_kind(one.kind, kind) && one.version >= later.version)
        .filter_map(|one| {
            let chosen = select(kind, one.version).ok()?;
            Some((one.version, count(&validate(chosen.schema))))
        });
    let best = tried.min_by_key(|(version, count)| (*count, *version));
    best.filter(|(_, found)| *found <= count(stated))
        .map(|(version, _)| version)
}

/// Returns the number of violations.
fn count(report: &Report<'_>) -> u64 {
    let listed = u64::try_from(report.violations.len()).unwrap_or(u64::MAX);
    let rest = report.rest.iter().map(|rest| rest.count);
    rest.fold(listed, u64::saturating_add)
}

/// Removes the uses of later features from a report for the header's version. Versions of OpenDRIVE
/// differ so much that a later schema would report other violations.
fn without<'a>(later: &Later<'a>, mut report: Report<'a>) -> Report<'a> {
    let mut places: HashSet<(u32, Option<&str>)> = HashSet::new();
    let mut subjects: HashSet<String> = HashSet::new();
    for thing in &later.things {
        let name = thing.attribute.map(|attribute| attribute.name());
        let nodes = thing.nodes.iter();
        places.extend(nodes.map(|node| (node.index(), name)));
        subjects.insert(match name {
            Some(name) => format!("{}/@{name}", thing.node.name()),
            None => thing.node.name().to_owned(),
        });
    }
    report.violations.retain(|one| {
        let name = one.attribute.map(|attribute| attribute.name());
        !is_strange(one.code) || !places.contains(&(one.node.index(), name))
    });
    report
        .rest
        .retain(|rest| !is_strange(rest.code) || !subjects.contains(&rest.subject));
    report
}

/// Reduces a report for the later version to violations that the header's version has too. The
/// author may either change the header or remove the later features.
fn left_by<'a>(stated: &Report<'a>, mut meant: Report<'a>) -> Report<'a> {
    // If violations are missing in the list, the comparison is impossible.
    if stated.rest.is_empty() {
        let places: HashSet<u32> = stated.violations.iter().map(Violation::offset).collect();
        meant
            .violations
            .retain(|one| places.contains(&one.offset()));
        meant.rest.clear();
    }
    meant
}

/// Checks whether the document is a modular scenario. Such a scenario refers to other scenarios, or
/// it has attributes that a referring scenario can replace.
fn is_modular(document: &Document<'_>) -> bool {
    document.elements("ScenarioReference").next().is_some()
        || document.names().any(|name| name == "parameterAttributes")
}

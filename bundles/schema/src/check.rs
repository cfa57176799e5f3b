//! The bodies of the two schema rules.

use std::collections::HashSet;
use std::sync::Arc;

use qcbus_document::{Document, FileKind};

use crate::later::{Later, is_strange, later};
use crate::model::Schema;
use crate::validate::Overlay;
use crate::versions::{SkipReason, Version, select, version_of};
use crate::violation::{Limits, Report, Rest, Violation};

/// A user schema: used instead of the shipped one.
#[derive(Clone, Debug)]
pub struct Override {
    /// The kind of file it is for.
    pub kind: FileKind,
    /// The header version it is for; `None` is any, headers without a version included.
    pub version: Option<Version>,
    /// The tables.
    pub schema: Arc<Schema>,
    /// The files that it was made of.
    pub sources: Arc<[Source]>,
}

/// A file that a schema was made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Its path.
    pub path: String,
    /// SHA-256 of its bytes, in hexadecimal.
    pub sha256: String,
}

/// How to check.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How many violations are listed.
    pub limits: Limits,
    /// The user's schemas; the first that fits is used.
    pub overrides: Vec<Override>,
}

/// How much a violation weighs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The file breaks its schema.
    Error,
    /// The file breaks its schema in a point where the schema is known to be wrong, or claims a version that
    /// no known schema describes.
    Information,
}

/// The outcome for one document.
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
    /// What the schema is called, e.g. `OpenDRIVE 1.7`.
    pub schema: String,
    /// The files of a user schema; empty for a shipped one.
    pub sources: Arc<[Source]>,
    /// The version the header names.
    pub version: Option<Version>,
    /// Whether that version is newer than the newest known schema, which was used instead.
    pub newer: bool,
    /// Whether the tags of modular scenarios were allowed.
    pub modular: bool,
    /// The default namespace of the root, which was disregarded: the published schemas have none,
    /// or one that no file uses.
    pub namespace: Option<&'a str>,
    /// What the document uses of later versions than its header names: one cause of many violations,
    /// of which those are left out that the later version does not know.
    pub later: Option<Later<'a>>,
    /// The violations in order of discovery.
    pub violations: Vec<Violation<'a>>,
    /// Violations beyond the limits, counted by kind.
    pub rest: Vec<Rest>,
}

/// Something that a result should say about the check itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// Its name.
    pub key: &'static str,
    /// What is so.
    pub value: String,
    /// What it means.
    pub description: &'static str,
}

impl Checked<'_> {
    /// Which schema the document was compared with: a shipped one, or the user's files.
    pub fn provenance(&self) -> Vec<Fact> {
        let fact = |value, description| Fact {
            key: "qcbus.schema",
            value,
            description,
        };
        if self.sources.is_empty() {
            return vec![fact(
                self.schema.clone(),
                "the schema that the file was compared with; it comes with qcbus",
            )];
        }
        let files = self.sources.iter();
        files
            .map(|file| {
                fact(
                    format!("{} sha256:{}", file.path, file.sha256),
                    "a file of the schema that the file was compared with, given by the user",
                )
            })
            .collect()
    }

    /// How much the violations of a kind weigh that are only counted.
    pub fn severity_of_rest(&self, rest: &Rest) -> Severity {
        match rest.known_schema_defect {
            _ if self.newer => Severity::Information,
            true => Severity::Information,
            false => Severity::Error,
        }
    }

    /// How much a violation weighs.
    pub fn severity(&self, violation: &Violation<'_>) -> Severity {
        match violation.known_schema_defect {
            _ if self.newer => Severity::Information,
            Some(_) => Severity::Information,
            None => Severity::Error,
        }
    }
}

/// Validates a document against the schema its header asks for.
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

/// Archives of scenarios are judged by the schema of their main file.
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
    let modular = kind != FileKind::Xodr && is_modular(document);
    let overlay = if modular {
        Overlay::ModularScenario
    } else {
        Overlay::None
    };
    let report = schema.validate_with(document, options.limits, overlay);
    let is_own = sources.is_empty() && !newer && !report.is_valid();
    let later = version
        .filter(|_| is_own)
        .and_then(|version| later(document, kind, version, &report));
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
    let namespace = document
        .root()
        .and_then(|root| root.attr("xmlns"))
        .filter(|namespace| !namespace.is_empty());
    Checked {
        schema: schema.title.to_string(),
        sources,
        version,
        newer,
        modular,
        namespace,
        later,
        violations,
        rest,
    }
}

/// What the version of the header finds fault with beside what came later. Versions of OpenDRIVE change so
/// much that a file of one is no file of the next: judged by the later one it would have other faults.
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

/// Of what a later version finds fault with, that with which the version of the header does so, too: the
/// author may let the header name the one or do without what the other has.
fn left_by<'a>(stated: &Report<'a>, mut meant: Report<'a>) -> Report<'a> {
    // Where not all is listed, nobody knows what is left.
    if stated.rest.is_empty() {
        let places: HashSet<u32> = stated.violations.iter().map(Violation::offset).collect();
        meant
            .violations
            .retain(|one| places.contains(&one.offset()));
        meant.rest.clear();
    }
    meant
}

/// Whether the document is a modular scenario: it refers to scenarios, or offers attributes to be
/// replaced by those that refer to it.
fn is_modular(document: &Document<'_>) -> bool {
    document.elements("ScenarioReference").next().is_some()
        || document.names().any(|name| name == "parameterAttributes")
}

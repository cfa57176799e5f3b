//! The schema rule of a bundle: what [`qcbus_schema`], which knows only documents, says about one, as
//! issues. What differs between bundles is the rule's name and page:
//!
//! ```text
//! pub static RULE: Rule<Validated> = Rule {
//!     id: "check_asam_xodr_xml_valid_schema",
//!     uids: &["asam.net:xodr:1.0.0:xml.valid_schema"],
//!     after: &["check_asam_xodr_xml_version_is_defined"],
//!     page: include_str!("xml_valid_schema.md"),
//!     ..qcbus_schema_rule::RULE
//! };
//! ```

mod model;

pub use model::Validated;

use model::{SCHEMA_DIR, SCHEMAS};
use qcbus_document::{Attribute, Document, Node};
use qcbus_schema::{Checked, Code, Later, Outcome, Severity, Version, Violation};
use qcbus_sdk::{Level, Place, Rule, Sink, Subject};

/// What the schema rules of all bundles have in common, for the `..` of one.
pub const RULE: Rule<Validated> = Rule {
    params: &[SCHEMA_DIR],
    resource: Some(&SCHEMAS),
    run,
    ..Rule::DEFAULTS
};

fn run(checked: &Checked<'_>, found: &mut Sink<'_>) {
    for fact in checked.provenance() {
        found.fact(fact.key, fact.value, fact.description);
    }
    if let Some(later) = &checked.later {
        say_later(later, checked.version, found);
    }
    for violation in &checked.violations {
        let place = match violation.attribute {
            Some(attribute) => Place::from(attribute),
            None => Place::from(violation.node),
        };
        found
            .issue(place, violation.text.as_str())
            .level(level(checked.severity(violation)));
    }
    say_replaced(found);
    for rest in &checked.rest {
        let Some(root) = found.subject().root().root() else {
            return;
        };
        let text = format!(
            "{} further findings like these are not listed: {}",
            rest.count,
            rest.code.about(&rest.subject)
        );
        found
            .issue(root, text)
            .level(level(checked.severity_of_rest(rest)));
    }
}

/// The groups of a modular scenario that are not in what it is expanded to, because others take their
/// place: they are looked at as they are written.
fn say_replaced(found: &mut Sink<'_>) {
    let subject = found.subject();
    if !subject.is_expanded() {
        return;
    }
    let written = subject.written();
    let is_replaced = |node: Node<'_>| {
        let mut around = std::iter::once(node).chain(node.ancestors());
        around.any(|it| it.is("ManeuverGroup") && it.child("ScenarioReference").is_some())
    };
    for breach in breaches(subject, &written) {
        if is_replaced(breach.node) {
            let place = match breach.attribute {
                Some(attribute) => Place::from(attribute),
                None => Place::from(breach.node),
            };
            found.issue(place, breach.text);
        }
    }
}

/// Places of what is newer than the header that are shown.
const MOST_SHOWN: usize = 3;

/// Says that a file is written for a later version than its header names.
fn say_later(later: &Later<'_>, stated: Option<Version>, found: &mut Sink<'_>) {
    let Some((newest, stated)) = later.things.first().zip(stated) else {
        return;
    };
    let position = newest.node.position();
    let row = match &newest.attribute {
        Some(attribute) => attribute.position().row,
        None => position.row,
    };
    let wherein = if position.is_root_file {
        format!("row {row}")
    } else {
        format!("row {row} of {}", position.path)
    };
    let more = match later.count.saturating_sub(1) {
        0 => String::new(),
        1 => ", and one more thing that came later".to_owned(),
        more => format!(", and {more} more things that came later"),
    };
    let text = format!(
        "the header says version {stated}, but the file uses {}, which came with version {} ({wherein}){more}; \
         let `revMinor` be {}, or do without",
        newest.what, newest.since, later.version.minor
    );
    let mut finding = found.issue(later.header, text);
    for thing in later.things.iter().take(MOST_SHOWN) {
        let what = format!("{}, of version {}", thing.what, thing.since);
        finding = match thing.attribute {
            Some(attribute) => finding.at(attribute, what),
            None => finding.at(thing.node, what),
        };
    }
}

/// Something that a document's schema does not allow.
pub struct Breach<'a> {
    /// The element that it is about.
    pub node: Node<'a>,
    /// The attribute that it is about.
    pub attribute: Option<Attribute<'a>>,
    /// What is wrong.
    pub text: String,
    /// What readers make of it.
    pub weight: Weight,
}

/// What readers make of something that a schema does not allow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// It cannot be read: a value that is none, or nothing where something must be.
    Unreadable,
    /// It is only too much, or not where it belongs: many readers pass over it.
    Superfluous,
    /// It came with a later version than the header names: who knows that one reads it.
    Later,
}

/// Where a document that a root refers to breaks its schema, in document order: the user's schema, or the
/// one that comes with qcbus. Where the schema is known to be wrong, or is not that of the document's
/// version, nothing is said.
pub fn breaches<'a>(subject: &Subject<'_>, document: &Document<'a>) -> Vec<Breach<'a>> {
    let Outcome::Checked(checked) =
        qcbus_schema::check(document, subject.kind(), &model::options(subject))
    else {
        return Vec::new();
    };
    let violations = checked
        .violations
        .iter()
        .filter(|violation| checked.severity(violation) == Severity::Error)
        .map(|violation| Breach {
            node: violation.node,
            attribute: violation.attribute,
            text: violation.text.clone(),
            weight: if is_unreadable(violation) {
                Weight::Unreadable
            } else {
                Weight::Superfluous
            },
        });
    let mut breaches: Vec<Breach<'a>> = violations.collect();
    if let (Some(later), Some(stated)) = (&checked.later, checked.version) {
        breaches.extend(newer_than(later, stated));
    }
    breaches.sort_by_key(|breach| breach.node.index());
    breaches
}

/// All that a document uses of later versions than its header names.
fn newer_than<'a>(later: &Later<'a>, stated: Version) -> impl Iterator<Item = Breach<'a>> {
    let things = later.things.iter();
    things.flat_map(move |thing| {
        let text = format!(
            "{} came with version {}, but its header says {stated}",
            thing.what, thing.since
        );
        let name = thing.attribute.map(|attribute| attribute.name());
        thing.nodes.iter().map(move |node| Breach {
            node: *node,
            attribute: name.and_then(|name| node.attribute(name)),
            text: text.clone(),
            weight: Weight::Later,
        })
    })
}

fn is_unreadable(violation: &Violation<'_>) -> bool {
    match violation.code {
        // Expressions came with a later version, and readers of that take them anywhere.
        Code::InvalidValue => !violation
            .attribute
            .is_some_and(|attribute| attribute.value().contains('$')),
        Code::InvalidText | Code::MissingAttribute | Code::MissingElement | Code::UnknownType => {
            true
        }
        _ => false,
    }
}

fn level(severity: Severity) -> Level {
    match severity {
        Severity::Error => Level::Error,
        Severity::Information => Level::Information,
    }
}

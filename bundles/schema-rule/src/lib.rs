//! The schema rule of a bundle: reports the violations that [`qcbus_schema`] finds in a document as
//! issues. Bundles differ only in the rule's name, precondition and page:
//!
//! ```text
//! pub const RULE: Rule<Validated> = Rule {
//!     after: &["check_asam_xodr_xml_version_is_defined"],
//!     ..qcbus_schema_rule::RULE
//! };
//! ```

mod model;

pub use model::Validated;

use model::{SCHEMA_DIR, SCHEMAS};
use qcbus_document::{Attribute, Document, Node};
use qcbus_schema::{Checked, Code, Later, Outcome, Rest, Severity, Version, Violation};
use qcbus_sdk::{Level, Place, Rule, Sink, Subject, fault_of, fault_of_attribute};

/// Common fields of the schema rules of all bundles, for struct update syntax (`..`).
pub const RULE: Rule<Validated> = Rule {
    params: &[SCHEMA_DIR],
    resource: Some(&SCHEMAS),
    run,
    ..Rule::DEFAULTS
};

fn run(checked: &Checked<'_>, found: &mut Sink<'_>) {
    run_with(checked, found, &Harm::EVERYTHING);
}

/// What readers do with files that violate a schema. By the standard, every violation is an error.
#[derive(Debug)]
pub struct Harm {
    /// Level of a violation.
    pub of_violation: fn(&Violation<'_>) -> Level,
    /// Level of a header that names an older version than the file uses.
    pub of_old_header: Level,
}

impl Harm {
    /// Readers refuse every file that violates the schema.
    pub const EVERYTHING: Harm = Harm {
        of_violation: |_| Level::Error,
        of_old_header: Level::Error,
    };
}

/// Reports the violations of a document. Their levels follow from the harm that they do to readers.
pub fn run_with(checked: &Checked<'_>, found: &mut Sink<'_>, harm: &Harm) {
    for fact in checked.provenance() {
        found.fact(fact.key, fact.value, fact.description);
    }
    if let Some(later) = &checked.later {
        say_later(later, checked.version, found, harm);
    }
    for violation in &checked.violations {
        let place = match violation.attribute {
            Some(attribute) => Place::from(attribute),
            None => Place::from(violation.node),
        };
        let severity = checked.severity(violation);
        // A rule about the same attribute says more, so it is reported first.
        let fault = match violation.attribute {
            Some(attribute) => fault_of_attribute(violation.node, attribute.name()),
            None => fault_of(violation.node),
        };
        let finding = found
            .issue(place, violation.text.as_str())
            .level(level(severity))
            .follows(fault);
        if severity == Severity::Error {
            finding.readers_level((harm.of_violation)(violation));
        }
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
        let severity = checked.severity_of_rest(rest);
        let finding = found.issue(root, text).level(level(severity));
        if severity == Severity::Error {
            finding.readers_level(harm_of_rest(checked, rest, harm));
        }
    }
}

/// Returns the worst level of the listed violations of the same kind, else an error.
fn harm_of_rest(checked: &Checked<'_>, rest: &Rest, harm: &Harm) -> Level {
    let alike = checked.violations.iter().filter(|violation| {
        let element = violation.node.name();
        let in_words = match &violation.attribute {
            Some(attribute) => format!("{element}/@{}", attribute.name()),
            None => element.to_owned(),
        };
        violation.code == rest.code && in_words == rest.subject
    });
    let levels = alike.map(|violation| (harm.of_violation)(violation));
    levels.min().unwrap_or(Level::Error)
}

/// Checks the groups of a modular scenario that are replaced by others in its expansion. They are
/// checked as written.
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

/// Maximum number of shown places with features that are newer than the header.
const MOST_SHOWN: usize = 3;

/// Reports that a file is written for a later version than its header names.
fn say_later(later: &Later<'_>, stated: Option<Version>, found: &mut Sink<'_>, harm: &Harm) {
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
        1 => ", and one more feature of a later version".to_owned(),
        more => format!(", and {more} more features of later versions"),
    };
    let remedy = match later.advice {
        Some(version) => format!(
            "set `revMinor` to {}, or remove the newer features",
            version.minor
        ),
        None => "remove the newer features; a later `revMinor` alone would not help, because the file violates the later \
                 versions at more places"
            .to_owned(),
    };
    let text = format!(
        "the header says version {stated}, but the file uses {}, which was introduced in version {} \
         ({wherein}){more}; {remedy}",
        newest.what, newest.since
    );
    let finding = found.issue(later.header, text);
    let mut finding = finding.readers_level(harm.of_old_header);
    for thing in later.things.iter().take(MOST_SHOWN) {
        let what = format!("{}, introduced in version {}", thing.what, thing.since);
        finding = match thing.attribute {
            Some(attribute) => finding.at(attribute, what),
            None => finding.at(thing.node, what),
        };
    }
}

/// A violation of a document's schema.
pub struct Breach<'a> {
    /// Element with the violation.
    pub node: Node<'a>,
    /// Attribute with the violation, if any.
    pub attribute: Option<Attribute<'a>>,
    /// Description of the violation.
    pub text: String,
    /// Consequence for readers of the document.
    pub weight: Weight,
}

/// Consequence of a schema violation for readers of the document.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Readers cannot read it: a value is invalid, or something required is missing.
    Unreadable,
    /// It is superfluous or misplaced. Many readers ignore it.
    Superfluous,
    /// It came with a later version than the header names. Readers of that version can read it.
    Later,
}

/// Returns the schema violations of a document that a root refers to, in document order. The schema
/// is the user's or the one that comes with qcbus. Known defects of the schema are left out. The
/// result is empty if the schema is for another version than the document's.
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

/// Returns all uses of features from later versions than the document's header names.
fn newer_than<'a>(later: &Later<'a>, stated: Version) -> impl Iterator<Item = Breach<'a>> {
    let things = later.things.iter();
    things.flat_map(move |thing| {
        let text = format!(
            "{} was introduced in version {}, but the header of its file says {stated}",
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
        // Expressions came with a later version. Readers of that version accept them in any
        // attribute.
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

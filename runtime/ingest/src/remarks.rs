//! Reports the findings of qcbus itself about a set of documents: faults and missing references,
//! independent of the demanded rules.

use qcbus_document::{Attribute, Document, FaultCode, FaultGroup, Node};
use qcbus_formats::Verdict;
use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::{BundleOutcome, Remark};
use qcbus_formats::xqar::{Issue, Level, Location, Locations};
use qcbus_messages::{Absence, DocumentRole, MissingDocument, Within};

/// Rule: each referenced file exists and can be read.
const REFERENCES: &str = "qcbus.dev:qcbus:1.0.0:file.references_resolved";
/// Rule: each file that the file rests on is accepted itself.
const RESTS_ON: &str = "qcbus.dev:qcbus:1.0.0:file.rests_on_accepted";
/// Rule: the file is complete and well-formed.
const WELL_FORMED: &str = "qcbus.dev:qcbus:1.0.0:file.well_formed";

/// Maximum number of listed findings. Further references are counted in one finding.
const MOST: usize = 100;

/// Returns all findings of qcbus itself about a document set. Faults of the root are reported only
/// if no bundle reports an error. Errors of bundles contain the same information and more.
pub fn remarks(
    root: &Document<'_>,
    missing: &[MissingDocument],
    bundles: &[BundleOutcome],
) -> Vec<Remark> {
    let mut checkers = bundles.iter().flat_map(|bundle| &bundle.checkers);
    let is_error = |issue: &Issue| issue.level == Level::Error;
    let is_said = checkers.any(|checker| checker.issues.iter().any(is_error));
    let mut remarks = match is_said {
        true => Vec::new(),
        false => faults_of_root(root),
    };
    // If a scenario cannot be expanded, a bundle or a missing reference already reports the reason
    // as an error.
    let references = missing
        .iter()
        .filter(|it| it.role != DocumentRole::Expanded && !is_blamed(root, it, bundles));
    let references: Vec<MissingDocument> = references.cloned().collect();
    let is_said = is_said || references.iter().any(|it| it.level == Level::Error);
    remarks.extend(missing_references(
        root,
        match is_said {
            true => &references,
            false => missing,
        },
    ));
    remarks
}

/// Checks whether a bundle reports an error at the same missing reference to a scenario. Bundles
/// that support modular scenarios give more information about it.
fn is_blamed(root: &Document<'_>, missing: &MissingDocument, bundles: &[BundleOutcome]) -> bool {
    if missing.role != DocumentRole::Scenario || missing.level != Level::Error {
        return false;
    }
    let own = missing_reference(root, missing).issue;
    let own = own.and_then(|issue| issue.locations.into_iter().next());
    let Some(own) = own else { return false };
    let is_there = |other: &Locations| match (&own.elsewhere, &other.elsewhere) {
        (None, None) => own.places.first() == other.places.first(),
        // qcbus may know only the element where the bundle knows the attribute, so only the rows
        // are compared.
        (Some(own), Some(other)) => (&own.path, own.row) == (&other.path, other.row),
        _ => false,
    };
    let checkers = bundles.iter().flat_map(|bundle| &bundle.checkers);
    let errors = checkers
        .flat_map(|checker| &checker.issues)
        .filter(|issue| issue.level == Level::Error);
    errors.flat_map(|issue| &issue.locations).any(is_there)
}

/// Returns findings for the missing files that the root refers to, each at its reference. If it is
/// unknown whether a reference has a target, the verdict stays open.
pub fn missing_references(root: &Document<'_>, missing: &[MissingDocument]) -> Vec<Remark> {
    let listed = missing.iter().take(MOST);
    let mut remarks: Vec<Remark> = listed.map(|it| missing_reference(root, it)).collect();
    if let Some(rest) = missing.get(MOST..).filter(|rest| !rest.is_empty()) {
        let level = rest.iter().map(|it| it.level).min();
        let text = format!("{} further references are not listed", rest.len());
        let level = level.unwrap_or(Level::Warning);
        remarks.push(reference_remark(text.clone(), text, level, Vec::new()));
    }
    remarks
}

fn missing_reference(root: &Document<'_>, missing: &MissingDocument) -> Remark {
    let what = match missing.role {
        DocumentRole::Map => "the map",
        DocumentRole::Catalog => "the catalog location",
        DocumentRole::Attachment => "the file",
        _ => "the scenario",
    };
    let MissingDocument {
        reference,
        path,
        why,
        within,
        ..
    } = missing;
    let looked = match path.as_str() {
        "" => String::new(),
        path if *why == Absence::NotThere && !reference.trim_start().starts_with('/') => {
            let because = match missing.role {
                DocumentRole::Scenario => "",
                _ => ", because relative paths start at the directory of the file",
            };
            format!("; the path resolves to `{path}`{because}")
        }
        path => format!("; the path resolves to `{path}`"),
    };
    let unused = match (missing.role, missing.level) {
        (DocumentRole::Catalog, Level::Information) => "; no reference uses it",
        _ => "",
    };
    let behind = within.as_ref().map_or_else(String::new, |within| {
        let Within { path, row, column } = within;
        format!("; {path}:{row}:{column} refers to it")
    });
    let text = format!("{what} `{reference}` {why}{looked}{unused}{behind}");
    let open = format!("the target of {what} `{reference}` is not known");
    let mut place = place_of(root, missing);
    place.elsewhere = within.as_ref().map(|within| OtherPlace {
        path: within.path.clone(),
        row: within.row.into(),
        column: within.column.into(),
        xpath: None,
    });
    reference_remark(text, open, missing.level, vec![place])
}

/// Checker of the bundle `qcbus` for files that a file rests on and that are not accepted
/// themselves.
pub const RESTS_ON_CHECKER: &str = "qcbus_rests_on";

/// A file that the root rests on, and its verdict.
#[derive(Debug, Clone, Copy)]
pub struct Resting<'a> {
    /// Its role for the root.
    pub role: DocumentRole,
    /// Byte offset of the element of the root that refers to it.
    pub referred_at: u32,
    /// Its absolute path.
    pub path: &'a str,
    /// Its verdict. `None` while these bytes have no verdict.
    pub verdict: Option<Verdict>,
    /// Number of errors in it, without those of the files that it rests on.
    pub errors: u64,
}

/// Reports that a file which the root rests on is not accepted itself. Returns `None` if it is
/// accepted. With `binding`, the verdict on the root depends on it; otherwise it is only
/// information.
pub fn resting(root: &Document<'_>, it: &Resting<'_>, binding: bool) -> Option<Remark> {
    if it.verdict == Some(Verdict::Accepted) {
        return None;
    }
    let fact = format!("{} {} {}", name_of_role(it.role), it.path, standing_of(it));
    let (text, level) = match (binding, it.verdict) {
        (false, _) => (
            format!("{fact}; the verdict on this file does not depend on it (--own-verdict)"),
            Level::Information,
        ),
        (true, Some(Verdict::Rejected)) => (
            format!("{fact}; this file is rejected until that one is fixed"),
            Level::Error,
        ),
        (true, _) => (fact.clone(), Level::Warning),
    };
    let open = (level == Level::Warning).then_some(fact);
    Some(rests_on_remark(root, it.referred_at, text, level, open))
}

/// Returns the finding that a file on which another one rests is not checked, because it is not
/// watched.
pub fn unwatched(root: &Document<'_>, role: DocumentRole, path: &str, referred_at: u32) -> Remark {
    let what = name_of_role(role);
    let text =
        format!("{what} {path} is not watched, so it is not checked; watch its directory, too");
    rests_on_remark(root, referred_at, text, Level::Warning, None)
}

fn rests_on_remark(
    root: &Document<'_>,
    referred_at: u32,
    text: String,
    level: Level,
    open: Option<String>,
) -> Remark {
    Remark {
        checker: RESTS_ON_CHECKER.to_owned(),
        description: String::from("All files that the file depends on are accepted."),
        open,
        issue: Some(Issue {
            id: 0,
            description: text,
            level,
            rule_uid: RESTS_ON.to_owned(),
            locations: vec![referring_place(root, referred_at)],
            domain_info: Vec::new(),
        }),
    }
}

fn name_of_role(role: DocumentRole) -> &'static str {
    match role {
        DocumentRole::Map => "the map",
        DocumentRole::Catalog => "the catalog",
        _ => "the scenario",
    }
}

fn standing_of(it: &Resting<'_>) -> String {
    match (it.verdict, it.errors) {
        (Some(Verdict::Rejected), 0) => {
            "is rejected, because it depends on a rejected file".to_owned()
        }
        (Some(Verdict::Rejected), 1) => "is rejected: it has 1 error".to_owned(),
        (Some(Verdict::Rejected), errors) => format!("is rejected: it has {errors} errors"),
        (Some(Verdict::Undetermined), _) => "is undetermined: see its own result".to_owned(),
        (None, _) => "has no verdict yet".to_owned(),
        (Some(Verdict::Accepted), _) => "is accepted".to_owned(),
    }
}

/// Returns the place of the attribute that holds a path, or else of the referring element.
fn referring_place(root: &Document<'_>, referred_at: u32) -> Locations {
    let mut nodes = root.root().into_iter().flat_map(|node| node.descendants());
    let Some(node) = nodes.find(|node| node.offset() == referred_at) else {
        return place_at(root, referred_at, None, "here");
    };
    let attribute = ["filepath", "path"]
        .into_iter()
        .find_map(|name| node.attribute(name));
    match attribute {
        Some(attribute) => attribute_place(root, node, attribute),
        None => place_at(root, referred_at, Some((node, "")), "the reference"),
    }
}

fn reference_remark(text: String, open: String, level: Level, locations: Vec<Locations>) -> Remark {
    Remark {
        checker: String::from("qcbus_references"),
        description: String::from("All files that the file refers to exist and can be read."),
        open: (level == Level::Warning).then_some(open),
        issue: Some(Issue {
            id: 0,
            description: text,
            level,
            rule_uid: REFERENCES.to_owned(),
            locations,
            domain_info: Vec::new(),
        }),
    }
}

/// Returns the place of the attribute that holds the reference, or else of the element.
fn place_of(root: &Document<'_>, missing: &MissingDocument) -> Locations {
    let mut nodes = root.root().into_iter().flat_map(|node| node.descendants());
    let Some(node) = nodes.find(|node| node.offset() == missing.referred_at) else {
        return place_at(root, missing.referred_at, None, "here");
    };
    let attribute = node
        .attributes()
        .find(|attribute| attribute.value() == missing.reference);
    match attribute {
        Some(attribute) => attribute_place(root, node, attribute),
        None => place_at(root, node.offset(), Some((node, "")), "the reference"),
    }
}

fn attribute_place(root: &Document<'_>, node: Node<'_>, attribute: Attribute<'_>) -> Locations {
    let name = attribute.name();
    let label = format!("attribute `{name}` of element `{}`", node.name());
    place_at(root, attribute.offset(), Some((node, name)), &label)
}

fn place_at(
    root: &Document<'_>,
    offset: u32,
    node: Option<(Node<'_>, &str)>,
    description: &str,
) -> Locations {
    let position = root.position(offset);
    // Results use byte offsets on disk. The image of a transcoded file has different ones.
    let transcoded = root
        .faults()
        .any(|fault| fault.code == FaultCode::EncodingTranscoded);
    let file = Location::File {
        row: position.row.into(),
        column: position.column.into(),
        offset: (!transcoded).then(|| position.offset.into()),
    };
    let xml = node.map(|(node, attribute)| Location::Xml {
        xpath: match attribute {
            "" => node.xpath(),
            attribute => format!("{}/@{attribute}", node.xpath()),
        },
    });
    Locations {
        description: description.to_owned(),
        elsewhere: None,
        places: std::iter::once(file).chain(xml).collect(),
    }
}

/// Returns the faults of the root itself, for which no bundle was called. A partially known file is
/// not accepted because of the demanded rules. Returns none if the file is complete.
pub fn faults_of_root(root: &Document<'_>) -> Vec<Remark> {
    let partial = root.faults().filter(|fault| fault.code.makes_partial());
    let remark = |fault: qcbus_document::Fault<'_>| {
        let limit = fault.code.group() == FaultGroup::Limit;
        Remark {
            checker: String::from("qcbus_file"),
            description: String::from("The file is complete and can be read."),
            open: limit.then(|| fault.text.to_owned()),
            issue: Some(Issue {
                id: 0,
                description: fault.text.to_owned(),
                level: Level::Error,
                rule_uid: WELL_FORMED.to_owned(),
                locations: vec![place_at(root, fault.offset, None, fault.code.as_str())],
                domain_info: Vec::new(),
            }),
        }
    };
    partial.take(MOST).map(remark).collect()
}

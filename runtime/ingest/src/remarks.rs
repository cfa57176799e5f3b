//! What qcbus itself finds in a set of documents: faults and missing references, whoever demanded what.

use qcbus_document::{Attribute, Document, FaultCode, FaultGroup, Node};
use qcbus_formats::location::OtherPlace;
use qcbus_formats::pool::{BundleOutcome, Remark};
use qcbus_formats::xqar::{Issue, Level, Location, Locations};
use qcbus_messages::{Absence, DocumentRole, MissingDocument, Within};

/// Rule: what the file refers to is there and can be read.
const REFERENCES: &str = "qcbus.dev:qcbus:1.0.0:file.references_resolved";
/// Rule: the file is whole and well-formed.
const WELL_FORMED: &str = "qcbus.dev:qcbus:1.0.0:file.well_formed";

/// More of them are counted in one remark.
const MOST: usize = 100;

/// Everything that qcbus itself has to say about a document set. The faults of the root are said only
/// when no bundle reports an error: theirs say the same and more.
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
    // Why a scenario cannot be expanded is an error of some bundle, or of a reference that is missing.
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

/// Whether a bundle reports an error at the very reference to a scenario that is missing: those that
/// know modular scenarios say more about it.
fn is_blamed(root: &Document<'_>, missing: &MissingDocument, bundles: &[BundleOutcome]) -> bool {
    if missing.role != DocumentRole::Scenario || missing.level != Level::Error {
        return false;
    }
    let own = missing_reference(root, missing).issue;
    let own = own.and_then(|issue| issue.locations.into_iter().next());
    let Some(own) = own else { return false };
    let is_there = |other: &Locations| match (&own.elsewhere, &other.elsewhere) {
        (None, None) => own.places.first() == other.places.first(),
        // Where the element is known here, the attribute may be there.
        (Some(own), Some(other)) => (&own.path, own.row) == (&other.path, other.row),
        _ => false,
    };
    let checkers = bundles.iter().flat_map(|bundle| &bundle.checkers);
    let errors = checkers
        .flat_map(|checker| &checker.issues)
        .filter(|issue| issue.level == Level::Error);
    errors.flat_map(|issue| &issue.locations).any(is_there)
}

/// What the root refers to and could not be had, each at its reference. What is not known to lead
/// nowhere keeps the verdict open.
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
                _ => ", because paths start at the directory of the file",
            };
            format!("; it was looked for at `{path}`{because}")
        }
        path => format!("; it was looked for at `{path}`"),
    };
    let unused = match (missing.role, missing.level) {
        (DocumentRole::Catalog, Level::Information) => "; nothing of it is referred to",
        _ => "",
    };
    let behind = within.as_ref().map_or_else(String::new, |within| {
        let Within { path, row, column } = within;
        format!("; {path}:{row}:{column} refers to it")
    });
    let text = format!("{what} `{reference}` {why}{looked}{unused}{behind}");
    let open = format!("where {what} `{reference}` leads is not known");
    let mut place = place_of(root, missing);
    place.elsewhere = within.as_ref().map(|within| OtherPlace {
        path: within.path.clone(),
        row: within.row.into(),
        column: within.column.into(),
        xpath: None,
    });
    reference_remark(text, open, missing.level, vec![place])
}

/// That the map of a scenario is rejected itself: whoever runs the scenario should know, and its own
/// verdict does not depend on it.
pub fn rejected_map(root: &Document<'_>, referred_at: u32, path: &str, errors: u64) -> Remark {
    let count = match errors {
        1 => "it has one error".to_owned(),
        _ => format!("it has {errors} errors"),
    };
    let text = format!(
        "the map {path} is rejected itself: {count}; the scenario was checked on it as far as it can be read"
    );
    let mut nodes = root.root().into_iter().flat_map(|node| node.descendants());
    let place = match nodes.find(|node| node.offset() == referred_at) {
        Some(node) => match node.attribute("filepath") {
            Some(path) => attribute_place(root, node, path),
            None => place_at(root, referred_at, Some((node, "")), "the reference"),
        },
        None => place_at(root, referred_at, None, "here"),
    };
    reference_remark(text, String::new(), Level::Information, vec![place])
}

fn reference_remark(text: String, open: String, level: Level, locations: Vec<Locations>) -> Remark {
    Remark {
        checker: String::from("qcbus_references"),
        description: String::from("What the file refers to is there and can be read."),
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

/// The attribute that holds the reference, else the element.
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
    // Results count bytes on disk; those of a transcoded file are others than the image's.
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

/// The faults of the root itself for which no bundle was asked: a file of which only a part is known
/// is not accepted because of what was demanded. None when the file is whole.
pub fn faults_of_root(root: &Document<'_>) -> Vec<Remark> {
    let partial = root.faults().filter(|fault| fault.code.makes_partial());
    let remark = |fault: qcbus_document::Fault<'_>| {
        let limit = fault.code.group() == FaultGroup::Limit;
        Remark {
            checker: String::from("qcbus_file"),
            description: String::from("The file is whole and can be read."),
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

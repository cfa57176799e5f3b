//! Catalogs: targets of references, and faults of the directories that they are looked up in.

use std::borrow::Cow;

use crate::prelude::*;
use foldhash::HashMap;
use qcbus_messages::{Absence, DocumentRole, MissingDocument};
use qcbus_sdk::Subject;

/// Fault of the directory of one kind of catalogs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Fault {
    /// The directory does not exist. The bus reports this as an error because something refers to
    /// it.
    Said,
    /// The path is empty. Some simulators take it as the scenario's own directory.
    NoPath,
    /// The directory contains no `.xosc` file.
    Empty,
    /// The path leads to a file.
    File,
}

/// Returns the references to catalogs in a scenario, including those within entries, and their
/// targets. Catalogs and distributions return none, because the locations that will apply to them
/// are unknown.
pub(crate) fn references<'m, 'd>(
    scenario: &'m Scenario<'d>,
) -> impl Iterator<Item = (Element<'m, 'd>, &'m Resolution<'d>)> {
    let all = (scenario.form() == Form::Scenario)
        .then(|| scenario.elements_everywhere("CatalogReference"));
    all.into_iter()
        .flatten()
        .map(|reference| (reference, scenario.resolution(reference)))
}

/// Returns the kinds of catalogs that a reference may lead to.
pub(crate) fn kinds(reference: Element<'_, '_>) -> &'static [CatalogKind] {
    let parent = reference.node().parent();
    CatalogKind::of_reference(parent.map_or("", |parent| parent.name()))
}

/// References that share a fault: the first one and their number. Each fault is reported once.
pub(crate) struct Once<'m, 'd, K> {
    seen: HashMap<K, usize>,
    found: Vec<(Element<'m, 'd>, u32)>,
}

impl<'m, 'd, K: std::hash::Hash + Eq> Once<'m, 'd, K> {
    pub(crate) fn new() -> Self {
        Once {
            seen: HashMap::default(),
            found: Vec::new(),
        }
    }

    pub(crate) fn add(&mut self, key: K, reference: Element<'m, 'd>) {
        let at = *self.seen.entry(key).or_insert(self.found.len());
        match self.found.get_mut(at) {
            Some((_, count)) => *count += 1,
            None => self.found.push((reference, 1)),
        }
    }

    pub(crate) fn each(self) -> impl Iterator<Item = (Element<'m, 'd>, u32)> {
        self.found.into_iter()
    }
}

/// Returns the end of a message about the first of several references.
pub(crate) fn further(count: u32) -> String {
    match count {
        0 | 1 => String::new(),
        2 => "; one further reference has the same fault".to_owned(),
        count => format!("; {} further references have the same fault", count - 1),
    }
}

/// Formats names in backticks, separated by commas.
pub(crate) fn listed<'n>(names: impl Iterator<Item = &'n str>) -> String {
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

/// Returns the fault of the directory of a kind, if there is one.
pub(crate) fn fault_of(
    scenario: &Scenario<'_>,
    subject: &Subject<'_>,
    kind: CatalogKind,
) -> Option<Fault> {
    let directory = scenario.catalog_directory(kind)?;
    if let Some(missing) = missing(subject, directory.node()) {
        return match (&missing.why, missing.level) {
            (Absence::EmptyPath, _) => Some(Fault::NoPath),
            (_, Level::Error) => Some(Fault::Said),
            _ => None,
        };
    }
    let folder = folder(subject, &directory.text("path")?)?;
    let paths = || {
        let linked = subject.with_role(DocumentRole::Catalog);
        linked.map(|linked| linked.path.as_str())
    };
    if paths().any(|path| path == folder) {
        return Some(Fault::File);
    }
    // The document itself is one of the files, although it is not read as its own catalog.
    let own = subject.root();
    let inside = |path: &str| {
        path.strip_prefix(folder.as_str())
            .is_some_and(|rest| rest.starts_with('/'))
    };
    let is_empty = !paths().any(inside) && !inside(own.path());
    is_empty.then_some(Fault::Empty)
}

/// Returns the faults of the directories by kind. Each directory is checked once.
pub(crate) fn faults(
    scenario: &Scenario<'_>,
    subject: &Subject<'_>,
) -> HashMap<CatalogKind, Fault> {
    let kinds = CatalogKind::ALL.into_iter();
    kinds
        .filter_map(|kind| Some((kind, fault_of(scenario, subject, kind)?)))
        .collect()
}

/// Returns the missing document that an element refers to.
pub(crate) fn missing<'s>(subject: &'s Subject<'_>, node: Node<'_>) -> Option<&'s MissingDocument> {
    let mut all = subject.missing().iter();
    all.find(|missing| missing.referred_at == node.offset())
}

/// Returns a path relative to the document in the notation of linked documents. Returns `None` if
/// the path is not plain.
fn folder(subject: &Subject<'_>, path: &str) -> Option<String> {
    let root = subject.root();
    let path = path.trim();
    let path = path.strip_prefix("file://").unwrap_or(path);
    // Only the bus can resolve archives and escaped paths.
    if path.is_empty() || path.contains(['$', '%']) || root.path().contains('!') {
        return None;
    }
    let path = path.replace('\\', "/");
    let whole = if path.starts_with('/') {
        Cow::Borrowed(path.as_str())
    } else {
        let (base, _) = root.path().rsplit_once('/')?;
        Cow::Owned(format!("{base}/{path}"))
    };
    let mut parts: Vec<&str> = Vec::new();
    for part in whole.split('/') {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop();
            }
            part => parts.push(part),
        }
    }
    Some(format!("/{}", parts.join("/")))
}

/// Returns the document's name without folders and extension.
pub(crate) fn stem(path: &str) -> &str {
    let name = path.rsplit(['/', '\\', '!']).next().unwrap_or(path);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

/// Checks whether a reference may mean a kind and does not lead to an entry of another kind.
pub(crate) fn is_use(reference: Element<'_, '_>, to: &Resolution<'_>, kind: CatalogKind) -> bool {
    match to {
        Resolution::Entry(entry) | Resolution::OtherLocation(entry) => {
            entry.node.is(kind.element())
        }
        _ => kinds(reference).contains(&kind),
    }
}

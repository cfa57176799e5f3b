//! Decides which documents of a set the root rests on. A fault of these documents is also a fault
//! of everything that runs the root.
//!
//! The map and the scenarios that a root refers to always count. In a catalog directory, only the
//! catalogs count from which the root takes an entry, because the directory may contain unrelated
//! files.

use std::collections::BTreeSet;

use qcbus_document::Document;
use qcbus_messages::DocumentRole;

use crate::references::Parameters;

/// A document of a set with its role; `None` when its image cannot be opened.
pub(crate) type Member<'d> = (DocumentRole, Option<Document<'d>>);

/// Returns, for each document of a set, whether the root rests on it. The root is the first.
pub(crate) fn rests_on(set: &[Member<'_>]) -> Vec<bool> {
    let used = used_catalogs(set);
    let counts = |(index, (role, _)): (usize, &Member<'_>)| match role {
        DocumentRole::Map | DocumentRole::Scenario => true,
        DocumentRole::Catalog => used.contains(&index),
        DocumentRole::Root
        | DocumentRole::Listing
        | DocumentRole::Expanded
        | DocumentRole::Attachment => false,
    };
    set.iter().enumerate().map(counts).collect()
}

/// Returns the catalogs from which entries are taken. A maneuver of one catalog may take its
/// trajectory from another one. Each used catalog may therefore lead to further ones.
fn used_catalogs(set: &[Member<'_>]) -> BTreeSet<usize> {
    let mut wanted = Wanted::default();
    for (role, document) in set {
        if let (DocumentRole::Root | DocumentRole::Expanded, Some(document)) = (role, document) {
            wanted.add(document);
        }
    }
    let mut used = BTreeSet::new();
    loop {
        let further = set
            .iter()
            .enumerate()
            .find_map(|(index, (role, document))| {
                let document = document.as_ref()?;
                let is_new = *role == DocumentRole::Catalog && !used.contains(&index);
                (is_new && wanted.is_met_by(document)).then_some((index, document))
            });
        let Some((index, document)) = further else {
            return used;
        };
        used.insert(index);
        wanted.add(document);
    }
}

/// Names of the referenced catalogs.
#[derive(Debug, Default)]
struct Wanted {
    names: BTreeSet<String>,
    /// Whether a name cannot be determined, so that it may be any name.
    any: bool,
}

impl Wanted {
    fn add(&mut self, document: &Document<'_>) {
        let parameters = Parameters::of(document);
        let references = document.elements("CatalogReference");
        for name in references.filter_map(|it| it.attr("catalogName")) {
            match parameters.fill(name) {
                Ok(name) => {
                    self.names.insert(name.trim().to_owned());
                }
                Err(_) => self.any = true,
            }
        }
    }

    fn is_met_by(&self, document: &Document<'_>) -> bool {
        let catalog = document.root().and_then(|root| root.child("Catalog"));
        let name = catalog.and_then(|catalog| catalog.attr("name"));
        match (catalog, name) {
            (None, _) => false,
            (Some(_), Some(name)) => self.any || self.names.contains(name.trim()),
            (Some(_), None) => self.any,
        }
    }
}

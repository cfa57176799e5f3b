//! Which documents of a set its root rests on: a fault of theirs is a fault of whatever runs the root.
//!
//! The map and the scenarios that a root refers to always count. Of the catalogs in a catalog
//! directory, only those count that the root takes an entry from: the directory may hold anything.

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
        DocumentRole::Root | DocumentRole::Listing | DocumentRole::Expanded => false,
    };
    set.iter().enumerate().map(counts).collect()
}

/// The catalogs that entries are taken from. A maneuver of one catalog may take its trajectory from
/// another one, so that each catalog that is used may lead to further ones.
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

/// The names of the catalogs that are referred to.
#[derive(Debug, Default)]
struct Wanted {
    names: BTreeSet<String>,
    /// A name cannot be told, so it may be any.
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

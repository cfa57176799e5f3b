use std::collections::BTreeSet;

use crate::assembly::{Assembly, Modular};
use crate::families::copies::{Taken, WrittenIn, short_name};
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_formats::distance::some_of;
use qcbus_messages::DocumentRole;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let missing = assembly.subject.missing().iter();
    // A catalog that could not be read may be the one that is referred to.
    if missing
        .into_iter()
        .any(|missing| missing.role == DocumentRole::Catalog)
    {
        return;
    }
    let catalogs: Vec<Node<'_>> = assembly
        .subject
        .with_role(DocumentRole::Catalog)
        .filter_map(|linked| linked.document.root()?.child("Catalog"))
        .collect();
    let origins = WrittenIn::of(assembly);
    let mut finds = Finds::default();
    for taken in assembly.taken() {
        for reference in taken.copy.group.descendants_named("CatalogReference") {
            let Some((attribute, wrong)) = wrong(&taken, reference, &catalogs) else {
                continue;
            };
            match origins.of_attribute(&taken, attribute) {
                Some(origin) => {
                    let text = format!("{} leads to no catalog entry: {wrong}", origin.what());
                    let at = origin.attribute().into();
                    finds.given(
                        at,
                        attribute.into(),
                        "the reference that gets the value",
                        text,
                    );
                }
                None => {
                    let text = format!(
                        "the group `{}` refers to a catalog entry that is not found in this scenario: {wrong}; \
                         the `CatalogLocations` of `{}` are not taken over",
                        taken.own_name(),
                        short_name(reference.document())
                    );
                    finds.brought(taken.at(), attribute.into(), "the reference", text);
                }
            }
        }
    }
    finds.say(found);
}

/// Returns the attribute of a reference that leads nowhere, with the reason.
fn wrong<'d>(
    taken: &Taken<'_, 'd>,
    reference: Node<'d>,
    catalogs: &[Node<'_>],
) -> Option<(Attribute<'d>, String)> {
    let attribute = reference.attribute("catalogName")?;
    let name = taken.value(attribute);
    if name.contains('$') {
        return None;
    }
    let mut meant = catalogs
        .iter()
        .filter(|catalog| catalog.attr("name") == Some(name))
        .peekable();
    if meant.peek().is_none() {
        return Some((
            attribute,
            format!(
                "the `CatalogLocations` here lead to no catalog `{name}`{}",
                known(name, catalogs)
            ),
        ));
    }
    let entry = reference.attribute("entryName")?;
    let wanted = taken.value(entry);
    let mut entries = meant.flat_map(|catalog| catalog.children());
    let is_there = entries.any(|entry| entry.attr("name") == Some(wanted));
    (!is_there && !wanted.contains('$')).then(|| {
        (
            entry,
            format!("the catalog `{name}` has no entry `{wanted}`"),
        )
    })
}

fn known(name: &str, catalogs: &[Node<'_>]) -> String {
    let names: BTreeSet<&str> = catalogs
        .iter()
        .filter_map(|catalog| catalog.attr("name"))
        .collect();
    if let Some(near) = closest(name, names.iter().copied()) {
        return format!("; perhaps `{near}` is meant");
    }
    match some_of(names) {
        None => " (they lead to none)".to_owned(),
        Some(names) => format!(", only to {names}"),
    }
}

use std::collections::HashSet;

use crate::assembly::{Assembly, Modular, place};
use crate::families::offers::{Offers, path};
use crate::prelude::*;
use qcbus_sdk::modular::Key;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let references = assembly.expansion.references.iter();
    let uses = references.flat_map(|reference| &reference.uses);
    for one in uses.filter(|one| !one.keys.is_empty()) {
        let offers = Offers::of(one);
        let bare = bare(one);
        for key in &one.keys {
            let why = ending(key, &bare, &offers).or_else(|| too_deep(key, &offers));
            let Some((attribute, text)) = why else {
                continue;
            };
            let at = place(Spot::of(key.node, "key"));
            let there = "the attribute at which the reference tool fails";
            found.issue(at, text).at(attribute, there);
        }
    }
}

fn bare<'d>(one: &Use<'d>) -> HashSet<&'d str> {
    let keys = one.keys.iter().map(|key| key.key);
    keys.filter(|key| !key.contains('.')).collect()
}

/// Returns an attribute whose name is a proper suffix of a key without dots. A name that is itself
/// a key is skipped, because the reference tool handles it before it compares suffixes.
fn ending<'d>(
    key: &Key<'d>,
    bare: &HashSet<&str>,
    offers: &Offers<'d>,
) -> Option<(Attribute<'d>, String)> {
    if key.key.contains('.') {
        return None;
    }
    let ends = key.key.char_indices().skip(1).map(|(at, _)| &key.key[at..]);
    let mut free = ends.filter(|end| !bare.contains(end));
    let attribute = free.find_map(|end| offers.named.get(end).copied())?;
    let instead = match offers.named.get(key.key) {
        Some(&meant) => format!("; put the element before it, `{}`", path(meant, 2)),
        None => "; put the element before it".to_owned(),
    };
    let text = format!(
        "the key `{}` ends with `{}`, an attribute that `{}` offers: the reference tool treats the key as a path \
         there, searches for an element in it and fails{instead}",
        key.key,
        attribute.name(),
        attribute.node().name()
    );
    Some((attribute, text))
}

/// Returns an attribute with fewer elements around it than the key names.
fn too_deep<'d>(key: &Key<'d>, offers: &Offers<'d>) -> Option<(Attribute<'d>, String)> {
    let named = key.key.split('.').count().saturating_sub(1);
    let depth = |attribute: Attribute<'_>| 1 + attribute.node().ancestors().count();
    let mut candidates = offers.ending(key.key).iter().copied();
    let attribute = candidates.find(|&attribute| named > depth(attribute))?;
    let text = format!(
        "the key `{}` names {named} elements, but `{}` of `{}` is inside only {}: the reference tool goes above \
         the root of the document and fails",
        key.key,
        attribute.name(),
        attribute.node().name(),
        depth(attribute)
    );
    Some((attribute, text))
}

use std::collections::HashMap;
use std::sync::atomic::Ordering;

use crate::assembly::{Assembly, Modular, place};
use crate::families::finds::Finds;
use crate::families::offers::{Offers, may_be_meant, path};
use crate::prelude::*;
use qcbus_formats::distance::did_you_mean;
use qcbus_sdk::modular::Key;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut wrong: HashMap<Node<'_>, Vec<(Attribute<'_>, String)>> = HashMap::new();
    let mut finds = Finds::default();
    for reference in &assembly.expansion.references {
        for one in &reference.uses {
            loose_keys(one, found);
            for group in one.copies.iter().map(|copy| copy.group) {
                let wrong = wrong.entry(group);
                for (list, text) in wrong.or_insert_with(|| wrong_offers(group).collect()) {
                    let there = "where the library lists what it offers";
                    let at = reference.node.into();
                    finds.brought(at, (*list).into(), there, text.clone());
                }
            }
        }
    }
    finds.say(found);
    // The checked file may itself be a library file.
    for group in assembly.root().elements("ManeuverGroup") {
        for (list, text) in wrong_offers(group) {
            found.issue(list, text);
        }
    }
}

fn loose_keys(one: &Use<'_>, found: &mut Sink<'_>) {
    // Only a key with at least four parts has elements in the middle.
    let has_middle = |key: &&Key<'_>| key.key.split('.').count() > 3;
    let mut keys = one.keys.iter().filter(has_middle).peekable();
    if keys.peek().is_none() {
        return;
    }
    let offers = Offers::of(one);
    for key in keys {
        if let Some(taken) = offers.taken_loosely(key.key).next() {
            say_loose(key, taken, found);
        }
    }
}

fn say_loose(key: &Key<'_>, taken: Attribute<'_>, found: &mut Sink<'_>) {
    let exact = path(taken, key.key.split('.').count());
    let of = format!("`{}` of `{}`", taken.name(), taken.node().name());
    let text = match key.fits.load(Ordering::Relaxed) {
        0 => format!(
            "the key `{}` is not the path of {of}, which is `{exact}`; the reference tool does not compare the \
             elements in the middle and replaces the attribute",
            key.key
        ),
        _ => format!(
            "the reference tool also applies the key `{}` to {of} with the path `{exact}`, because it does not \
             compare the elements in the middle; here the attribute keeps its value",
            key.key
        ),
    };
    let at = place(Spot::of(key.node, "key"));
    found
        .issue(at, text)
        .at(taken, "the attribute that the reference tool replaces");
}

/// Finds the faults in the lists of offered attributes of a group.
fn wrong_offers<'d>(group: Node<'d>) -> impl Iterator<Item = (Attribute<'d>, String)> {
    let lists = group
        .descendants()
        .filter_map(|element| element.attribute(OFFERS));
    lists.filter_map(|list| wrong_offer(list).map(|text| (list, text)))
}

fn wrong_offer(list: Attribute<'_>) -> Option<String> {
    let element = list.node();
    let names = list.value().split(',').map(str::trim);
    let wrong = names.filter(|name| !name.is_empty() && element.attribute(name).is_none());
    let (mut misspelt, mut absent) = (Vec::new(), Vec::new());
    for name in wrong {
        match misspelt_offer(element, name) {
            Some(text) => misspelt.push(text),
            None => absent.push(absent_offer(element, name)),
        }
    }
    let left = absent.len().saturating_sub(MOST_NAMED);
    absent.truncate(MOST_NAMED);
    misspelt.truncate(MOST_NAMED);
    if left > 0 {
        absent.push(format!("{left} more"));
    }
    if !absent.is_empty() {
        misspelt.push(format!(
            "`{OFFERS}` lists {}, which this `{}` does not have, so no value can be set: missing attributes are \
             not added",
            absent.join(", "),
            element.name()
        ));
    }
    (!misspelt.is_empty()).then(|| misspelt.join("; "))
}

/// Maximum number of named faults per list.
const MOST_NAMED: usize = 5;

/// Describes a fault in how a list names attributes that exist.
fn misspelt_offer(element: Node<'_>, name: &str) -> Option<String> {
    let between = |c: char| c.is_whitespace() || matches!(c, ';' | '|' | '/' | ':');
    let parts = || name.split(between).filter(|part| !part.is_empty());
    let is_list = parts().count() > 1 && parts().all(|part| element.attribute(part).is_some());
    if is_list {
        let list: Vec<&str> = parts().collect();
        return Some(format!(
            "`{OFFERS}` lists `{name}`, which is read as one name: separate names with commas only, `{}`",
            list.join(",")
        ));
    }
    let last = name.rsplit('.').next().unwrap_or(name);
    let is_path = last != name && element.attribute(last).is_some();
    is_path.then(|| {
        format!(
            "`{OFFERS}` lists `{name}`, but only attributes of the element itself can be offered, by their \
             names: `{last}`"
        )
    })
}

/// Describes a listed name without an attribute, with a suggestion.
fn absent_offer(element: Node<'_>, name: &str) -> String {
    let others = element.attributes().map(|attribute| attribute.name());
    let others = others.filter(|other| *other != OFFERS && may_be_meant(name, other));
    let hint = did_you_mean(name, others);
    match hint.strip_prefix("; ") {
        Some(hint) => format!("`{name}` ({hint})"),
        None => format!("`{name}`"),
    }
}

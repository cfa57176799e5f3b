use std::collections::HashSet;

use qcbus_document::{Attribute, Node};
use qcbus_formats::distance::did_you_mean;
use qcbus_sdk::modular::{Key, OFFERS, Spot, Use};
use qcbus_sdk::{Level, Rule, Sink};

use crate::assembly::{Assembly, Modular, place};
use crate::families::offers::{Offers, may_be_meant, path};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_key_path_exact",
    uids: &["qcbus.dev:mosc:1.0.0:key.path_exact"],
    level: Level::Warning,
    page: include_str!("key_path_exact.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut seen = HashSet::new();
    for reference in &assembly.expansion.references {
        for one in &reference.uses {
            loose_keys(one, found);
            let groups = one.copies.iter().map(|copy| copy.group);
            for group in groups.filter(|&group| seen.insert(group)) {
                for (list, text) in wrong_offers(group) {
                    let there = "where the library lists what it offers";
                    found.issue(reference.node, text).at(list, there);
                }
            }
        }
    }
    // A library file that is checked on its own.
    for group in assembly.root().elements("ManeuverGroup") {
        for (list, text) in wrong_offers(group) {
            found.issue(list, text);
        }
    }
}

fn loose_keys(one: &Use<'_>, found: &mut Sink<'_>) {
    // Only a key of four parts has any in the middle.
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
    let text = match key.fits.get() {
        0 => format!(
            "the key `{}` is not the path of {of}, which is `{exact}`; the reference tool does not compare the elements \
             in the middle and replaces it",
            key.key
        ),
        _ => format!(
            "the reference tool takes the key `{}` for {of} as well, whose path is `{exact}`, because it does not \
             compare the elements in the middle; here it keeps its value",
            key.key
        ),
    };
    let at = place(Spot::of(key.node, "key"));
    found
        .issue(at, text)
        .at(taken, "what the reference tool replaces");
}

/// What is wrong with the lists of attributes that the elements of a group offer.
fn wrong_offers<'d>(group: Node<'d>) -> impl Iterator<Item = (Attribute<'d>, String)> {
    let lists = group
        .descendants()
        .filter_map(|element| element.attribute(OFFERS));
    lists.flat_map(|list| {
        let names = list.value().split(',').map(str::trim);
        let wrong =
            names.filter(move |name| !name.is_empty() && list.node().attribute(name).is_none());
        wrong.map(move |name| (list, wrong_offer(list.node(), name)))
    })
}

fn wrong_offer(element: Node<'_>, name: &str) -> String {
    let between = |c: char| c.is_whitespace() || matches!(c, ';' | '|' | '/' | ':');
    let parts = || name.split(between).filter(|part| !part.is_empty());
    let is_list = parts().count() > 1 && parts().all(|part| element.attribute(part).is_some());
    if is_list {
        let list: Vec<&str> = parts().collect();
        return format!(
            "`{OFFERS}` lists `{name}`, which is taken for one name: only a comma parts names, `{}`",
            list.join(",")
        );
    }
    let last = name.rsplit('.').next().unwrap_or(name);
    if last != name && element.attribute(last).is_some() {
        return format!(
            "`{OFFERS}` lists `{name}`, but only attributes of the element itself are offered, by their names: `{last}`"
        );
    }
    let others = element.attributes().map(|attribute| attribute.name());
    let others = others.filter(|other| *other != OFFERS && may_be_meant(name, other));
    let hint = did_you_mean(name, others);
    format!(
        "`{OFFERS}` lists `{name}`, which this `{}` does not have, so no value can be put there: none is added where \
         none is{hint}",
        element.name()
    )
}

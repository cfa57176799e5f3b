use std::collections::HashMap;
use std::sync::atomic::Ordering;

use crate::assembly::{Assembly, Modular, place, say, say_all};
use crate::families::offers::{offered_in, path};
use crate::prelude::*;
use qcbus_sdk::modular::Key;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(assembly, found, &[What::KeyTie], "the attribute");
    for problem in assembly.problems(&[What::KeyOverlap]) {
        let key = problem.at.node().attr("key").unwrap_or("");
        let level = match key.contains('.') {
            true => Level::Error,
            false => Level::Warning,
        };
        say(found, problem, "the attribute that both match").level(level);
    }
    for reference in &assembly.expansion.references {
        for one in &reference.uses {
            spread(one, reference.piece, found);
        }
    }
}

/// Reports keys without an element that set attributes of different kinds of elements.
fn spread(one: &Use<'_>, piece: usize, found: &mut Sink<'_>) {
    let is_spread = |key: &&Key<'_>| !key.key.contains('.') && key.wins.load(Ordering::Relaxed) > 1;
    let mut keys = one.keys.iter().filter(is_spread).peekable();
    if keys.peek().is_none() {
        return;
    }
    let winners = winners(one, piece);
    for key in keys {
        if let Some(attributes) = winners.get(&key.value.value_offset()) {
            say_spread(key, attributes, found);
        }
    }
}

/// Returns the attributes that a use sets, one per kind of element, by the offset of the value.
fn winners<'d>(one: &Use<'d>, piece: usize) -> HashMap<u32, Vec<Attribute<'d>>> {
    let mut winners: HashMap<u32, Vec<Attribute<'d>>> = HashMap::new();
    for copy in &one.copies {
        for attribute in offered_in(copy.group) {
            let new = copy.edit(attribute).filter(|new| new.piece == piece);
            let Some(new) = new else { continue };
            let sorts = winners.entry(new.offset).or_default();
            let is_known = |other: &Attribute<'_>| other.node().is(attribute.node().name());
            if sorts.len() < MOST_SHOWN && !sorts.iter().any(is_known) {
                sorts.push(attribute);
            }
        }
    }
    winners
}

/// Maximum number of shown kinds of elements.
const MOST_SHOWN: usize = 3;

fn say_spread(key: &Key<'_>, spread: &[Attribute<'_>], found: &mut Sink<'_>) {
    let [first, _, ..] = spread else {
        return;
    };
    let elements: Vec<String> = spread
        .iter()
        .map(|attribute| format!("`{}`", attribute.node().name()))
        .collect();
    let text = format!(
        "the key `{}` gives `{}` to attributes of different elements, {}; add the intended element to the key, \
         as in `{}`",
        key.key,
        key.value.value(),
        elements.join(" and "),
        path(*first, 2)
    );
    let at = place(Spot::of(key.node, "key"));
    let mut finding = found.issue(at, text).level(Level::Warning);
    for &attribute in spread {
        finding = finding.at(attribute, "an attribute that gets the value");
    }
}

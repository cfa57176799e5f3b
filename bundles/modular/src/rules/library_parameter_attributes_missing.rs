use crate::assembly::{Assembly, Modular};
use crate::families::copies::{short_name, taken_at};
use crate::families::finds::Finds;
use crate::families::offers::{offers_any, unoffered};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

/// Maximum number of elements that a finding shows.
const MOST: usize = 5;

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut finds = Finds::default();
    for reference in &assembly.expansion.references {
        for one in reference.uses.iter().filter(|one| !one.keys.is_empty()) {
            let groups: Vec<Node<'_>> = one.copies.iter().map(|copy| copy.group).collect();
            if let Some(first) = groups.first().filter(|_| !offers_any(&groups)) {
                note(reference, one, (*first, &groups), &mut finds);
            }
        }
    }
    finds.say(found);
}

/// Notes that a group offers no attributes, and where the keys would match.
fn note<'d>(
    reference: &Followed<'d>,
    one: &Use<'d>,
    (group, groups): (Node<'d>, &[Node<'d>]),
    finds: &mut Finds<'d>,
) {
    let text = format!(
        "keys are given to the group `{}` of `{}`, but it offers no attributes: no element in it has `{OFFERS}`, \
         which lists the attributes that keys may set",
        group.attr("name").unwrap_or(""),
        short_name(group.document())
    );
    let at = taken_at(reference, one);
    let Some(find) = finds.brought(at, Spot::of(group, "name"), "the group", text) else {
        return;
    };
    let wanted = one.keys.iter().flat_map(|key| {
        let fitting = unoffered(key.key, groups).next();
        fitting.map(|attribute| (key, attribute))
    });
    for (key, attribute) in wanted.take(MOST) {
        let there = format!(
            "the key `{}` would match here, with `{OFFERS}=\"{}\"`",
            key.key,
            attribute.name()
        );
        find.besides(attribute, there);
    }
}

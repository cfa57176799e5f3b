use std::collections::HashSet;

use crate::assembly::{Assembly, Modular};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Information,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut seen = HashSet::new();
    for reference in &assembly.expansion.references {
        // Another rule reports a group that no other group replaces.
        let groups: Vec<Node<'_>> = groups(reference).collect();
        if groups.is_empty() || !seen.insert((reference.piece, reference.group.index())) {
            continue;
        }
        let referring = reference.group;
        say_attributes("the referring group", referring, &groups, found);
        if let Some(actors) = referring.child("Actors") {
            let theirs: Vec<Node<'_>> = groups.iter().filter_map(|it| it.child("Actors")).collect();
            say_attributes("`Actors` of the referring group", actors, &theirs, found);
        }
        say_children(referring, found);
    }
}

/// Returns the groups that replace the referring one.
fn groups<'a, 'd>(reference: &'a Followed<'d>) -> impl Iterator<Item = Node<'d>> + use<'a, 'd> {
    let copies = reference.uses.iter().flat_map(|one| &one.copies);
    copies.map(|copy| copy.group)
}

fn say_attributes(what: &str, own: Node<'_>, theirs: &[Node<'_>], found: &mut Sink<'_>) {
    let travels = |attribute: &Attribute<'_>| {
        attribute.is("name") || attribute.is(OFFERS) || attribute.name().starts_with("xmlns")
    };
    for attribute in own.attributes().filter(|attribute| !travels(attribute)) {
        let (name, value) = (attribute.name(), attribute.value().trim());
        let differs = |other: &&Node<'_>| other.attr(name).map(str::trim) != Some(value);
        let Some(other) = theirs.iter().find(differs) else {
            continue;
        };
        let kept = match other.attr(name) {
            Some(kept) => format!("keeps its own, `{kept}`"),
            None => "has none".to_owned(),
        };
        let text = format!(
            "`{name}` of {what} is `{value}` and is dropped: the group that replaces it {kept}; put the required \
             value into the library file"
        );
        let there = "what applies instead";
        match other.attribute(name) {
            Some(kept) => found.issue(attribute, text).at(kept, there),
            None => found.issue(attribute, text).at(*other, there),
        };
    }
}

fn say_children(referring: Node<'_>, found: &mut Sink<'_>) {
    for child in referring.children() {
        if child.is("Actors") || child.is("ScenarioReference") {
            continue;
        }
        let name = ["name", "entryName"]
            .into_iter()
            .find_map(|it| child.attr(it));
        let name = name.map_or_else(String::new, |name| format!(" `{name}`"));
        let text = format!(
            "`{}`{name} of the referring group is dropped: other groups replace the whole group, and only its \
             name and its first actor are kept; put it in a separate group",
            child.name()
        );
        found.issue(child, text).level(Level::Warning);
    }
}

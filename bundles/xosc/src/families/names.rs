//! Names within one element.

use std::borrow::Cow;
use std::collections::HashMap;

use crate::prelude::*;

/// Reports children of one element with the same `name`, of any kind.
///
/// Properties are left out. Their names are keys of values and not targets of references.
pub(crate) fn unique_among_siblings(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    for parent in std::iter::once(root).chain(root.descendants()) {
        let named = || {
            parent
                .children()
                .filter(|child| !child.is("Property") && child.attribute("name").is_some())
        };
        if named().nth(1).is_none() {
            continue;
        }
        let mut first: HashMap<&str, Node<'_>> = HashMap::new();
        for child in named() {
            let Some(name) = child.attr("name") else {
                continue;
            };
            if let Some(known) = first.get(name) {
                let text = format!(
                    "the name `{name}` is already used by a child `{}` of this `{}`; names on one level must be \
                     unique",
                    known.name(),
                    parent.name()
                );
                found
                    .issue(child, text)
                    .at(Place::Node(*known), "the first element with this name");
            } else {
                first.insert(name, child);
            }
        }
    }
}

/// Elements that may also be in maneuvers of catalogs.
const IN_STORIES: &[&str] = &["Maneuver", "Event", "Action"];
/// Elements that others refer to by name.
const NAMED: &[&str] = &[
    "ScenarioObject",
    "EntitySelection",
    "Story",
    "Act",
    "ManeuverGroup",
    "Catalog",
    "TrafficSignalController",
    "Phase",
];

/// Returns the elements that others refer to by name, with their names. These are entities,
/// elements of the storyboard, catalogs and their entries, traffic signal controllers and their
/// phases.
pub(crate) fn keys<'m, 'd>(
    scenario: &'m Scenario<'d>,
) -> impl Iterator<Item = (Element<'m, 'd>, Cow<'d, str>)> {
    let own = NAMED.iter().flat_map(|name| scenario.elements(name));
    let in_stories = IN_STORIES
        .iter()
        .flat_map(|name| scenario.elements_everywhere(name));
    let entries = scenario
        .elements("Catalog")
        .flat_map(Element::children)
        .filter(|entry| !entry.is("Maneuver"));
    own.chain(in_stories)
        .chain(entries)
        .filter_map(|element| Some((element, element.text("name")?)))
}

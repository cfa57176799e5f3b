//! Names within one element.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};

use crate::prelude::*;

/// Reports children of one element with the same `name`, of any kind.
///
/// Properties are left out. Their names are keys of values and not targets of references.
pub(crate) fn unique_among_siblings(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    let referred = Referred::of(root);
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
                let finding = found
                    .issue(child, text)
                    .at(Place::Node(*known), "the first element with this name");
                if !referred.may_be(child, name) || is_repeated(child, *known) {
                    finding.readers_level(Level::Warning);
                }
            } else {
                first.insert(name, child);
            }
        }
    }
}

/// Checks whether both declare the same parameter with the same value.
fn is_repeated(one: Node<'_>, other: Node<'_>) -> bool {
    let alike = |name| one.attr(name) == other.attr(name);
    one.is("ParameterDeclaration")
        && other.is("ParameterDeclaration")
        && ["parameterType", "value"].into_iter().all(alike)
        && one.children().next().is_none()
        && other.children().next().is_none()
}

/// Why siblings of the same name harm by case.
pub(crate) const BY_CASE: Readers = Readers::by_case(
    "an element of the story whose name occurs twice harms only if something refers to the name, and a parameter only \
     if its values differ",
);

/// Elements of a story. Only conditions refer to them.
const STORY: &[&str] = &[
    "Story",
    "Act",
    "ManeuverGroup",
    "Maneuver",
    "Event",
    "Action",
    "ConditionGroup",
    "Condition",
];

/// Names in the references to elements of the story.
struct Referred<'d> {
    names: HashSet<&'d str>,
    /// A parameter names an element.
    any: bool,
}

impl<'d> Referred<'d> {
    fn of(root: Node<'d>) -> Referred<'d> {
        let references = root
            .descendants()
            .filter_map(|node| node.attr("storyboardElementRef"));
        let names: HashSet<&str> = references.flat_map(|it| it.split("::")).collect();
        let any = names.iter().any(|name| name.contains('$'));
        Referred { names, any }
    }

    fn may_be(&self, element: Node<'_>, name: &str) -> bool {
        let is_entry = element.parent().is_some_and(|it| it.is("Catalog"));
        let in_story = !is_entry && STORY.iter().any(|it| element.is(it));
        !in_story || self.any || self.names.contains(name)
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

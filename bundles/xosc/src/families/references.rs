//! References by name: their targets, and the messages for unresolved names.

use super::positions::{listed, sorted};
use crate::prelude::*;
use foldhash::HashSet;

/// Attributes that name one entity, by the standard's table of entity type constraints.
pub(crate) const SINGLE_ENTITY: &[(&str, &str)] = &[
    ("CentralObject", "entityRef"),
    ("FromCurrentEntity", "entityRef"),
    ("LateralDistanceAction", "entityRef"),
    ("LongitudinalDistanceAction", "entityRef"),
    ("RelativeAngleCondition", "entityRef"),
    ("RelativeDistanceCondition", "entityRef"),
    ("RelativeLanePosition", "entityRef"),
    ("RelativeObjectPosition", "entityRef"),
    ("RelativeRoadPosition", "entityRef"),
    ("RelativeSpeedCondition", "entityRef"),
    ("RelativeTargetLane", "entityRef"),
    ("RelativeTargetLaneOffset", "entityRef"),
    ("RelativeTargetSpeed", "entityRef"),
    ("RelativeWorldPosition", "entityRef"),
    ("TimeHeadwayCondition", "entityRef"),
    ("TrailerRef", "entityRef"),
    ("ConnectTrailerAction", "trailerRef"),
    ("SynchronizeAction", "masterEntityRef"),
];

/// Attributes that name a scenario object or a selection.
const ANY_ENTITY: &[(&str, &str)] = &[
    ("EntityRef", "entityRef"),
    ("Private", "entityRef"),
    ("EntityAction", "entityRef"),
    ("SpeedProfileAction", "entityRef"),
];

/// Returns all attributes that name entities.
pub(crate) fn entity_references() -> impl Iterator<Item = (&'static str, &'static str)> {
    ANY_ENTITY.iter().chain(SINGLE_ENTITY).copied()
}

/// Maximum number of findings with a hint per rule.
const MOST_HINTS: u64 = 100;

/// Reports an unresolved reference. `what` is the kind of its target, and `names` are the existing
/// names.
pub(crate) fn unresolved<'n>(
    reference: Element<'_, '_>,
    attribute: &str,
    name: &str,
    what: &str,
    names: impl Iterator<Item = &'n str>,
    found: &mut Sink<'_>,
) {
    // A hint compares all names. With so many faults the cause is probably not a typo.
    let hint = if found.count() < MOST_HINTS {
        hint_or_all(name, names)
    } else {
        String::new()
    };
    let text = format!(
        "`{}` refers to the {what} {}, which does not exist{hint}",
        reference.name(),
        quoted(reference, attribute, name)
    );
    found.about(reference, attribute, text);
}

/// Formats the name in backticks. If it comes from a parameter or an expression, the written text
/// is added.
pub(crate) fn quoted(element: Element<'_, '_>, attribute: &str, value: &str) -> String {
    match element.written(attribute) {
        Some(written) if written != value => format!("`{value}` (`{written}`)"),
        _ => format!("`{value}`"),
    }
}

/// Suggests a name that differs by white space, case or one or two letters.
pub(crate) fn hint<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> String {
    match near(name, names) {
        Some(near) if plain(near) == plain(name) => {
            format!("; `{near}` exists; names must match exactly")
        }
        Some(near) => format!("; perhaps `{near}` is meant"),
        None => String::new(),
    }
}

/// Normalises a name: removes white space and case.
fn plain(name: &str) -> String {
    name.split_whitespace().collect::<String>().to_lowercase()
}

/// Suggests a similar name. If there is none, lists some of the existing names.
pub(crate) fn hint_or_all<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> String {
    let names: Vec<&str> = names.filter(|name| !name.is_empty()).collect();
    let hint = hint(name, names.iter().copied());
    if !hint.is_empty() {
        return hint;
    }
    let names = sorted(names.into_iter());
    match names.as_slice() {
        [] => String::new(),
        [only] => format!("; only `{only}` exists"),
        all => format!("; existing names are {}", listed(all.iter().copied())),
    }
}

/// Returns the name that is probably meant by a misspelt one.
fn near<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let names: Vec<&str> = names.collect();
    if names.is_empty() {
        return None;
    }
    let wanted = plain(name);
    let spaced = names.iter().find(|other| plain(other) == wanted).copied();
    spaced.or_else(|| qcbus_openscenario::closest(name, names.iter().copied()))
}

/// Names of reported references without a target. A declaration that such a name probably means is
/// not also reported as unused.
#[derive(Default)]
pub(crate) struct Dangling(HashSet<String>);

impl Dangling {
    /// Adds a name. The size is limited, because thousands of names may meet thousands of faults.
    pub(crate) fn add(&mut self, name: &str) {
        const MOST: usize = 100;
        if self.0.len() < MOST && !self.0.contains(name) {
            self.0.insert(name.to_owned());
        }
    }

    /// Checks whether one of them is probably this name misspelt.
    pub(crate) fn may_mean(&self, name: &str) -> bool {
        let mut all = self.0.iter();
        all.any(|one| near(one, std::iter::once(name)).is_some())
    }
}

/// Returns the referenced names of entities that do not exist.
pub(crate) fn dangling_entities(scenario: &Scenario<'_>) -> Dangling {
    let mut dangling = Dangling::default();
    for (element, attribute) in entity_references() {
        for reference in scenario.elements_everywhere(element) {
            let name = reference.text(attribute);
            if let Some(name) = name.filter(|name| !scenario.entities().contains(name)) {
                dangling.add(&name);
            }
        }
    }
    dangling
}

//! Traffic signals and their controllers.

use std::borrow::Cow;

use crate::families::positions::listed;
use crate::families::references::{self, quoted};
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _, HashSet};

/// Reports elements of a name that refer to signals that the map does not have.
pub(crate) fn missing_signals(
    scenario: &Scenario<'_>,
    element: &str,
    attribute: &str,
    found: &mut Sink<'_>,
) {
    let looked = scenario.on_map(|map| missing_on(scenario, Some(map), element, attribute, found));
    looked.unwrap_or_else(|| missing_on(scenario, None, element, attribute, found));
}

fn missing_on(
    scenario: &Scenario<'_>,
    map: Option<&RoadMap<'_>>,
    element: &str,
    attribute: &str,
    found: &mut Sink<'_>,
) {
    let mut known = None;
    for reference in scenario.elements_everywhere(element) {
        let Some(id) = reference.text(attribute) else {
            continue;
        };
        if id.trim().is_empty() {
            let text = format!(
                "`{attribute}` of `{element}` is empty; it must be the id of a signal of the road network"
            );
            found.about(reference, attribute, text);
            continue;
        }
        let Some(map) = map else { continue };
        if map.signals_with_id(&id).next().is_some() {
            continue;
        }
        let known = known.get_or_insert_with(|| Known::of(map));
        let text = format!(
            "`{element}` refers to the signal {}, but the road network has no signal with this id{}",
            quoted(reference, attribute, &id),
            known.instead_of(map, &id)
        );
        let finding = found.about(reference, attribute, text);
        if let Some(root) = map.root() {
            finding.at(root, "the road network");
        }
    }
}

/// Signals of the map, for suggestions on an unknown id.
struct Known<'r> {
    /// Ids by name.
    by_name: HashMap<&'r str, &'r str>,
    ids: String,
}

impl<'r> Known<'r> {
    fn of(map: &RoadMap<'r>) -> Known<'r> {
        let named = map
            .signals()
            .filter_map(|(_, signal)| Some((signal.node().attr("name")?, signal.id()?)));
        let mut by_name = HashMap::new();
        for (name, id) in named {
            by_name.entry(name).or_insert(id);
        }
        Known {
            by_name,
            ids: listed(map.signals().filter_map(|(_, signal)| signal.id())),
        }
    }

    fn instead_of(&self, map: &RoadMap<'_>, id: &str) -> String {
        if let Some(own) = self.by_name.get(id) {
            return format!("; a signal with this name exists; its id is `{own}`");
        }
        if map.controllers_with_id(id).next().is_some() {
            return "; this is the id of a controller, not of a signal".to_owned();
        }
        if self.ids.is_empty() {
            "; the road network has no signals".to_owned()
        } else {
            format!("; the road network has the signals {}", self.ids)
        }
    }
}

/// The controllers of the scenario by name, the first of each name.
pub(crate) struct Controllers<'m, 'd> {
    /// Controllers in document order.
    pub(crate) all: Vec<Element<'m, 'd>>,
    names: Vec<String>,
    by_name: HashMap<String, usize>,
    /// Whether the name of every controller is known.
    pub(crate) complete: bool,
}

impl<'m, 'd> Controllers<'m, 'd> {
    pub(crate) fn of(scenario: &'m Scenario<'d>) -> Controllers<'m, 'd> {
        let signals = scenario.root().path(&["RoadNetwork", "TrafficSignals"]);
        let all: Vec<_> = signals
            .into_iter()
            .flat_map(|signals| signals.children_named("TrafficSignalController"))
            .collect();
        let mut by_name = HashMap::new();
        let mut names = Vec::new();
        let mut complete = true;
        for (at, controller) in all.iter().enumerate() {
            match controller.text("name") {
                Some(name) => {
                    names.push(name.to_string());
                    by_name.entry(name.into_owned()).or_insert(at);
                }
                None => complete = false,
            }
        }
        Controllers {
            all,
            names,
            by_name,
            complete,
        }
    }

    /// Returns the index of a controller in `all`.
    pub(crate) fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(name).copied()
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.names.iter().map(String::as_str)
    }

    /// Reports an attribute that names a missing controller.
    pub(crate) fn resolve(
        &self,
        reference: Element<'_, '_>,
        attribute: &str,
        found: &mut Sink<'_>,
    ) {
        let Some(name) = reference.text(attribute) else {
            return;
        };
        if self.complete && self.find(&name).is_none() {
            let names = self.names();
            references::unresolved(
                reference,
                attribute,
                &name,
                "traffic signal controller",
                names,
                found,
            );
        }
    }
}

/// Reports elements of a name that refer to phases that their controller does not have. Another
/// rule reports missing controllers.
pub(crate) fn missing_phases(scenario: &Scenario<'_>, element: &str, found: &mut Sink<'_>) {
    let controllers = Controllers::of(scenario);
    let phases: Vec<_> = controllers.all.iter().map(|one| Phases::of(*one)).collect();
    for reference in scenario.elements_everywhere(element) {
        let names = reference
            .text("trafficSignalControllerRef")
            .zip(reference.text("phase"));
        let Some((name, phase)) = names else { continue };
        let Some(at) = controllers.find(&name) else {
            continue;
        };
        let Some((controller, phases)) = controllers.all.get(at).zip(phases.get(at)) else {
            continue;
        };
        if !phases.complete || phases.names.contains(&phase) {
            continue;
        }
        let text = format!(
            "`{element}` refers to the phase {}, but the controller `{name}` {}",
            quoted(reference, "phase", &phase),
            phases.listed
        );
        found
            .about(reference, "phase", text)
            .at(controller.node(), "the controller");
    }
}

/// The phases of a controller.
struct Phases<'d> {
    names: HashSet<Cow<'d, str>>,
    /// Names of the phases for a message.
    listed: String,
    /// Whether all names are known.
    complete: bool,
}

impl<'d> Phases<'d> {
    fn of(controller: Element<'_, 'd>) -> Phases<'d> {
        let names = || {
            controller
                .children_named("Phase")
                .map(|phase| phase.text("name"))
        };
        let known: Vec<_> = names().flatten().collect();
        Phases {
            listed: if known.is_empty() {
                "has no phases".to_owned()
            } else {
                format!("has {}", listed(known.iter().map(|phase| &**phase)))
            },
            names: known.into_iter().collect(),
            complete: names().all(|name| name.is_some()),
        }
    }
}

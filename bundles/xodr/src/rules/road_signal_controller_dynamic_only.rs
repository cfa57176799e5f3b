use crate::families::object_parts::named;
use crate::families::signal_catalog::is_light;
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_opendrive::SignalKey;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    if map.controllers().next().is_none() {
        return;
    }
    let controls = map.controllers().flat_map(|one| one.controls());
    let switched: HashSet<&str> = controls.filter_map(|one| one.signal_id()).collect();
    // If several signals share an id, the switched one is unknown.
    let mut signals: HashMap<&str, Option<&SignalKey<'_>>> = HashMap::default();
    for key in map.signal_keys() {
        let id = key.id.filter(|id| switched.contains(id));
        let Some(id) = id else { continue };
        let known = signals.entry(id).or_insert(Some(key));
        if known.is_some_and(|known| known.signal != key.signal) {
            *known = None;
        }
    }
    for controller in map.controllers() {
        for control in controller.controls() {
            let signal = control
                .signal_id()
                .and_then(|id| signals.get(id).copied().flatten());
            let Some(key) = signal.filter(|key| key.dynamic == Some(false)) else {
                continue;
            };
            let signal = key.signal;
            // `road.signal.light_is_dynamic` reports lights.
            if is_light(signal.node()) {
                continue;
            }
            let text = format!(
                "{} switches {} of type `{}`, whose `dynamic` is `no`; only signals that change should be switched",
                named(controller.node()),
                named(signal.node()),
                signal.kind().unwrap_or_default()
            );
            found
                .issue(Place::attribute_or_node(control.node(), "signalId"), text)
                .at(
                    Place::attribute_or_node(signal.node(), "dynamic"),
                    "the signal",
                );
        }
    }
}

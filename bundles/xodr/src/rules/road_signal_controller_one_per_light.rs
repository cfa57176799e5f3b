use crate::families::object_parts::{Stands, named};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_opendrive::Control;
use qcbus_opendrive::Controller;
use qcbus_opendrive::Signal;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[SHARE],
    run,
    ..Rule::after(READABLE)
};

const SHARE: Param = Param::number(
    "share",
    0.4,
    "",
    "largest fraction of a map's lights that count as exceptions; a larger fraction counts as the style of the \
     map",
);

/// A light with its control and controller.
struct Switched<'a> {
    control: Control<'a>,
    controller: Controller<'a>,
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut switched: HashMap<&str, Vec<Switched<'_>>> = HashMap::default();
    for controller in map.controllers() {
        for control in controller.controls() {
            if let Some(id) = control.signal_id() {
                let by = switched.entry(id).or_default();
                by.push(Switched {
                    control,
                    controller,
                });
            }
        }
    }
    if switched.is_empty() {
        return;
    }
    let share = found.number(&SHARE);
    by_several(&switched, share, found);
    by_none(map, &switched, share, found);
}

/// Reports lights with two controllers. It reports none if most lights have several, because some
/// tools write a controller per phase and repeat the lights.
fn by_several(switched: &HashMap<&str, Vec<Switched<'_>>>, share: f64, found: &mut Sink<'_>) {
    let mut several: Vec<_> = switched.iter().filter(|(_, by)| by.len() > 1).collect();
    if several.len() as f64 > share * switched.len() as f64 {
        return;
    }
    several.sort_by_key(|(_, by)| by.first().map(|one| one.control.node()));
    for (id, by) in several {
        let [first, others @ ..] = by.as_slice() else {
            continue;
        };
        for other in others {
            let text = format!(
                "signal `{id}` is switched by {} and by {}; a light should have only one controller",
                named(first.controller.node()),
                if other.controller.node() == first.controller.node() {
                    "the same controller again".to_owned()
                } else {
                    named(other.controller.node())
                }
            );
            found
                .issue(
                    Place::attribute_or_node(other.control.node(), "signalId"),
                    text,
                )
                .at(first.control.node(), "the first control of the signal");
        }
    }
}

/// Reports lights without a controller if other lights of the same type in the map have one.
fn by_none(
    map: &RoadMap<'_>,
    switched: &HashMap<&str, Vec<Switched<'_>>>,
    share: f64,
    found: &mut Sink<'_>,
) {
    let lights: Vec<Signal<'_>> = map
        .signal_keys()
        .iter()
        .filter(|key| key.dynamic == Some(true))
        .map(|key| key.signal)
        .collect();
    let is_switched = |signal: &Signal<'_>| signal.id().is_some_and(|id| switched.contains_key(id));
    let depends = dependents(&lights);
    let kinds: HashSet<Option<&str>> = lights
        .iter()
        .filter(|signal| is_switched(signal))
        .map(Signal::kind)
        .collect();
    let alone: Vec<&Signal<'_>> = lights
        .iter()
        .filter(|signal| !is_switched(signal) && kinds.contains(&signal.kind()))
        .filter(|signal| signal.id().is_none_or(|id| !depends.contains(id)))
        .collect();
    if alone.len() as f64 > share * lights.len() as f64 {
        return;
    }
    for signal in alone {
        let node: Node<'_> = signal.node();
        let text = format!(
            "no controller switches {} of type `{}`, although other lights of this type have one; a `control` \
             should refer to its id",
            named(node),
            signal.kind().unwrap_or_default()
        );
        found
            .issue(Place::attribute_or_node(node, "id"), text)
            .stands(map, node);
    }
}

/// Returns the signals that other signals switch.
fn dependents<'a>(lights: &[Signal<'a>]) -> HashSet<&'a str> {
    let all = lights.iter().flat_map(|signal| signal.dependencies());
    all.filter_map(|dependency| dependency.id()).collect()
}

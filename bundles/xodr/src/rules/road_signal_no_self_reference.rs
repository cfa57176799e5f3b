use crate::families::object_parts::{Stands, below, named};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for signal in below(map, "signal", "signals") {
        // An empty text is not an id.
        let Some(id) = signal.attr("id").filter(|id| !id.trim().is_empty()) else {
            continue;
        };
        for dependency in signal.children_named("dependency") {
            if dependency.attr("id") == Some(id) {
                say(map, signal, dependency, "id", "depends on", found);
            }
        }
        for reference in signal.children_named("reference") {
            let to_signal = reference.attr("elementType") == Some("signal");
            if to_signal && reference.attr("elementId") == Some(id) {
                say(map, signal, reference, "elementId", "refers to", found);
            }
        }
    }
}

fn say<'a>(
    map: &RoadMap<'a>,
    signal: Node<'a>,
    node: Node<'a>,
    attribute: &'static str,
    does: &str,
    found: &mut Sink<'_>,
) {
    let text = format!(
        "{} {does} itself; this has no meaning, so another signal or object is probably intended",
        named(signal)
    );
    found
        .issue(Place::attribute_or_node(node, attribute), text)
        .at(signal, "the signal")
        .stands(map, signal);
}

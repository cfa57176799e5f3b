use crate::families::object_parts::named;
use crate::prelude::*;
use foldhash::HashSet;
use qcbus_opendrive::Controller;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let junctions = map.junctions().iter();
    let named_there: HashSet<&str> = junctions
        .flat_map(|junction| junction.controllers())
        .filter_map(|controller| controller.id())
        .collect();
    if named_there.is_empty() {
        none_named(map, found);
        return;
    }
    for controller in map.controllers() {
        let Some(id) = controller.id().filter(|id| !named_there.contains(id)) else {
            continue;
        };
        let text = format!(
            "no junction refers to {}, although junctions refer to other controllers of this map; a junction \
             with lights that it switches should have a `controller` with the id `{id}`",
            named(controller.node())
        );
        found.issue(Place::attribute_or_node(controller.node(), "id"), text);
    }
}

/// Reports once that no junction of the map names any controller, where a controller switches
/// lights.
fn none_named(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let switching = |one: &Controller<'_>| one.controls().next().is_some();
    let mut controllers = map.controllers().filter(switching);
    let Some(first) = controllers.next() else {
        return;
    };
    let others = match controllers.count() {
        0 => String::new(),
        count => format!(" and {count} more"),
    };
    let text = format!(
        "no junction refers to {}{others}; a junction with lights that a controller switches should have a \
         `controller` with its id",
        named(first.node())
    );
    found.issue(Place::attribute_or_node(first.node(), "id"), text);
}

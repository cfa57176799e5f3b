use crate::families::object_parts::named;
use crate::prelude::*;
use foldhash::HashSet;

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
    // If no junction of the map names any controller, this is the style of the map.
    if named_there.is_empty() {
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

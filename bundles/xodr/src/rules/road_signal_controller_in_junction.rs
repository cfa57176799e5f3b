use crate::families::object_parts::named;
use crate::prelude::*;
use foldhash::HashSet;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_road_signal_controller_in_junction",
    uids: &["qcbus.dev:xodr:1.1.0:road.signal.controller.in_junction"],
    level: Level::Information,
    after: super::READABLE,
    page: include_str!("road_signal_controller_in_junction.md"),
    run,
    ..Rule::DEFAULTS
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

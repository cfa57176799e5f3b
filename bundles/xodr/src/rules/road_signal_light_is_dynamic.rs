use crate::families::object_parts::{Stands, named};
use crate::families::signal_catalog::is_light;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for signal in road.signals() {
            let node = signal.node();
            if signal.dynamic() != Some(false) || !is_light(node) {
                continue;
            }
            let text = format!(
                "{} is a traffic light (type `{}`), but its `dynamic` is `no`, so it never changes; traffic lights \
                 need `dynamic=\"yes\"`, otherwise no controller and no scenario can switch them",
                named(node),
                signal.kind().unwrap_or_default()
            );
            found
                .issue(Place::attribute_or_node(node, "dynamic"), text)
                .stands(map, node);
        }
    }
}

use crate::families::object_parts::{below, number};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Elements with `sStart` and `sEnd` on one road, with their parents and their names in texts.
const RANGES: [(&str, &str, &str); 2] = [
    ("CRG", "surface", "the CRG record"),
    ("segment", "platform", "the segment of the platform"),
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (name, parent, what) in RANGES {
        for node in below(map, name, parent) {
            check(map, node, what, found);
        }
    }
}

fn check<'a>(map: &RoadMap<'a>, node: Node<'a>, what: &str, found: &mut Sink<'_>) {
    let range = number(node, "sStart").zip(number(node, "sEnd"));
    let Some((start, end)) = range.filter(|(start, end)| end < start) else {
        return;
    };
    let text = format!(
        "{what} starts at s = {start}, but ends before that at s = {end}; `sEnd` should be the larger value"
    );
    let finding = found.issue(Place::attribute_or_node(node, "sEnd"), text);
    let road = node.attr("roadId").and_then(|id| map.road(id));
    if let Some(road) = road.or_else(|| map.road_of(node)) {
        finding.road(road.id(), start, 0.0);
    }
}

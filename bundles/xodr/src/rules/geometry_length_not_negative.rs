use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    // From 1.5 on the schema reports this.
    versions: "..1.5.0",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            let Some(length) = geometry.length().filter(|length| *length < 0.0) else {
                continue;
            };
            let text = format!(
                "this piece of the reference line is {} m long; a length must not be negative",
                number(length)
            );
            let finding = found.issue(Place::attribute_or_node(geometry.node(), "length"), text);
            if let Some(s) = geometry.s() {
                finding.road(road.id(), s, 0.0);
            }
        }
    }
}

use crate::prelude::*;
use qcbus_sdk::fault_of;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        if !road.plan_view().geometries().is_empty() {
            continue;
        }
        let (place, what) = match road.plan_view_node() {
            Some(node) => (node, "an empty `planView`"),
            None => (road.node(), "no `planView`"),
        };
        let text = format!(
            "road `{}` has {what}; each road must have a reference line of at least one `geometry`",
            road.id()
        );
        found.issue(place, text).fault(fault_of(place));
    }
}

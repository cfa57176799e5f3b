use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        let Some(id) = lane.id() else { continue };
        let text = match lane.side() {
            None if id != 0 => format!("the center lane has id {id}; it must have id 0"),
            Some(_) if id == 0 => {
                "this lane beside the center lane has id 0, which is reserved for the center lane"
                    .to_owned()
            }
            _ => continue,
        };
        found.issue(Place::attribute_or_node(lane.node(), "id"), text);
    }
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(lateral) = road.lateral_node() else {
            continue;
        };
        let Some(surface) = lateral.child("crossSectionSurface") else {
            continue;
        };
        for other in ["superelevation", "shape"] {
            let Some(first) = lateral.child(other) else {
                continue;
            };
            let text = format!(
                "road `{}` has a `crossSectionSurface` and `{other}`; a cross section surface must not be \
                 combined with shape or superelevation",
                road.id()
            );
            found
                .issue(surface, text)
                .at(first, format!("the first `{other}`"));
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for geometry in road.plan_view().geometries() {
            let mut shapes = geometry.shapes();
            let Some(first) = shapes.next() else {
                let text = "the `geometry` has no shape; it must contain exactly one of `line`, `spiral`, `arc`, \
                            `poly3` and `paramPoly3`";
                found.issue(geometry.node(), text);
                continue;
            };
            for further in shapes {
                let text = format!(
                    "the `geometry` contains `{}` besides `{}`; it must contain exactly one shape",
                    further.name(),
                    first.name()
                );
                found.issue(further, text).at(first, "the first shape");
            }
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let mut lines = road.node().children_named("planView");
        let Some(first) = lines.next() else { continue };
        for further in lines {
            let text = format!(
                "road `{}` has a second `planView`; a road has exactly one reference line",
                road.id()
            );
            found.issue(further, text).at(first, "the first one");
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

/// Elements for connections or areas, which crossings do not have.
const FOREIGN: [&str; 4] = ["connection", "crossPath", "boundary", "elevationGrid"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Crossing) {
            continue;
        }
        let id = junction.id();
        for child in junction
            .node()
            .children()
            .filter(|child| FOREIGN.contains(&child.name()))
        {
            let text = format!(
                "crossing `{id}` has an element `{}`; crossings must be described only by `roadSection` elements",
                child.name()
            );
            found.issue(child, text);
        }
        if junction.road_sections().next().is_none() {
            let text =
                format!("crossing `{id}` has no `roadSection`, so it is undefined what crosses");
            found.issue(junction.node(), text);
        }
    }
}

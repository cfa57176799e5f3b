use std::collections::HashSet;

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Crossing) {
            continue;
        }
        let sections = junction.road_sections();
        let crossing: HashSet<&str> = sections.filter_map(|section| section.road_id()).collect();
        let priorities = junction.priorities();
        let mut highs = priorities.filter_map(|priority| Some((priority.high()?, priority)));
        let Some((first, priority)) = highs.find(|(high, _)| crossing.contains(high)) else {
            continue;
        };
        for (high, further) in highs.filter(|(high, _)| *high != first && crossing.contains(high)) {
            let text = format!(
                "road `{high}` has high priority at crossing `{}`, although road `{first}` has it already; only \
                 one of the crossing roads may have it",
                junction.id()
            );
            found
                .issue(Place::attribute_or_node(further.node(), "high"), text)
                .at(priority.node(), "the first one with high priority");
        }
    }
}

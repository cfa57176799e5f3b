use crate::families::faults::OfFault as _;
use crate::families::junction_ends::{Meeting, name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Direct) {
            continue;
        }
        let Some(meeting) = Meeting::of(map, junction) else {
            continue;
        };
        let pairs: Vec<_> = meeting.pairs().collect();
        let Some((one, other)) = pairs.first() else {
            continue;
        };
        let in_all = |end: &RoadEnd| pairs.iter().all(|pair| pair.0 == *end || pair.1 == *end);
        if pairs.len() > 1 && (in_all(one) || in_all(other)) {
            continue;
        }
        let named = pairs
            .iter()
            .map(|(one, other)| format!("{} with {}", name(map, *one), name(map, *other)));
        let text = format!(
            "direct junction `{}` connects {}; it must connect one road on one side with several roads on the \
             other side",
            junction.id(),
            named.collect::<Vec<_>>().join(", ")
        );
        // A single pair is harmless, because it could be a direct link between the roads.
        let level = if pairs.len() == 1 {
            Level::Warning
        } else {
            Level::Error
        };
        found
            .issue(junction.node(), text)
            .level(level)
            .of_junction(junction.node());
    }
}

use crate::families::faults::OfFault as _;
use crate::families::junction_ends::{Meeting, name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.4.0:junctions.common.when_to_use",
        "asam.net:xodr:1.9.0:junctions.common.not_only_two",
    ],
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

/// First version with a rule about junctions of two roads.
const TWO_ROADS_SINCE: Version = Version::new(1, 9);

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let is_new = found
        .version()
        .is_some_and(|version| version >= TWO_ROADS_SINCE);
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Common) || junction.cross_paths().next().is_some()
        {
            continue;
        }
        let Some(meeting) = Meeting::of(map, junction) else {
            continue;
        };
        let partners = meeting.partners();
        let is_choice = partners
            .iter()
            .any(|(end, others)| others.len() > 1 || others.contains(end));
        let ends: Vec<_> = partners.keys().map(|end| name(map, *end)).collect();
        if is_choice || ends.is_empty() {
            continue;
        }
        let id = junction.id();
        if let [one, other] = ends.as_slice() {
            let text = format!(
                "only {one} and {other} meet at junction `{id}`; two roads should be linked directly, without \
                 a junction"
            );
            let finding = found
                .issue(junction.node(), text)
                .of_junction(junction.node());
            if is_new {
                finding.uid("asam.net:xodr:1.9.0:junctions.common.not_only_two");
            }
        } else {
            let text = format!(
                "at junction `{id}`, no road leads to more than one other ({}); junctions are meant for roads \
                 with two or more possible successors",
                ends.join(", ")
            );
            found
                .issue(junction.node(), text)
                .level(Level::Information)
                .of_junction(junction.node());
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        "asam.net:xodr:1.7.0:junctions.type_default_no_linked_road",
        "asam.net:xodr:1.7.0:junctions.direct.correct_type_linked_road_usage",
    ],
    versions: "1.7.0..",
    run,
    ..Rule::after(READABLE)
};

const ONLY_DIRECT: &str = "asam.net:xodr:1.7.0:junctions.direct.correct_type_linked_road_usage";

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        let kind = match junction.kind() {
            None | Some(JunctionType::Direct) => continue,
            Some(kind) => kind,
        };
        let Some(linked) = connection.node().attribute("linkedRoad") else {
            continue;
        };
        let text = format!(
            "a connection of junction `{}`, which is of type `{}`, has linkedRoad = `{}`; only junctions of \
             type `direct` link roads without a connecting road",
            junction.id(),
            kind.as_str(),
            linked.value()
        );
        let finding = found.issue(linked, text);
        if kind == JunctionType::Crossing {
            finding.uid(ONLY_DIRECT);
        }
    }
}

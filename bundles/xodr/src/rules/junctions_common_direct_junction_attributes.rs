use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, connection) in map.connections() {
        let kind = match junction.kind() {
            None | Some(JunctionType::Direct) => continue,
            Some(kind) => kind,
        };
        for link in connection.lane_links() {
            if let Some(zone) = link.node().attribute("overlapZone") {
                let text = format!(
                    "a lane link of junction `{}`, which is of type `{}`, has an `overlapZone`; only lane links \
                     of direct junctions may have one",
                    junction.id(),
                    kind.as_str()
                );
                found.issue(zone, text);
            }
        }
    }
}

use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_common_direct_junction_attributes",
    uids: &["asam.net:xodr:1.8.0:junctions.common.direct_junction_attributes"],
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("junctions_common_direct_junction_attributes.md"),
    run,
    ..Rule::DEFAULTS
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

use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_boundary_only_for_common_junctions",
    uids: &["asam.net:xodr:1.8.0:junctions.boundary.only_for_common_junctions"],
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("junctions_boundary_only_for_common_junctions.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let kind = match junction.kind() {
            None | Some(JunctionType::Common) => continue,
            Some(kind) => kind,
        };
        if let Some(boundary) = junction.boundary() {
            let text = format!(
                "junction `{}` of type `{}` has a boundary; only common junctions (type `default`) may have one",
                junction.id(),
                kind.as_str()
            );
            found.issue(boundary.node(), text);
        }
    }
}

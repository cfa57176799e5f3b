use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_qcbus_xodr_junctions_elevation_grid_placed",
    uids: &["qcbus.dev:xodr:1.4.0:junctions.elevation_grid_placed"],
    level: Level::Warning,
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("junctions_elevation_grid_placed.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let Some(grid) = junction.elevation_grid() else {
            continue;
        };
        match junction.kind() {
            Some(JunctionType::Common) => {}
            // The schema reports an invalid type.
            None => continue,
            Some(kind) => {
                let text = format!(
                    "junction `{}` of type `{}` has an `elevationGrid`; only common junctions (type `default`) \
                     may have one",
                    junction.id(),
                    kind.as_str()
                );
                found.issue(grid.node(), text);
                continue;
            }
        }
        if junction.plan_view().geometries().is_empty() {
            let text = format!(
                "the `elevationGrid` of junction `{}` lies along the junction's reference line, but there is \
                 none; `planView` must define one, otherwise the positions of the heights are undefined",
                junction.id()
            );
            found.issue(grid.node(), text);
        }
    }
}

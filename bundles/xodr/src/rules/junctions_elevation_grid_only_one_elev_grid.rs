use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_elevation_grid_only_one_elev_grid",
    uids: &["asam.net:xodr:1.8.0:junctions.elevation_grid.only_one_elev_grid"],
    versions: "1.8.0..",
    after: super::READABLE,
    page: include_str!("junctions_elevation_grid_only_one_elev_grid.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let mut grids = junction.elevation_grids();
        let Some(first) = grids.next() else { continue };
        for further in grids {
            let text = format!(
                "junction `{}` has a second `elevationGrid`; it must have only one",
                junction.id()
            );
            found
                .issue(further.node(), text)
                .at(first.node(), "the first one");
        }
    }
}

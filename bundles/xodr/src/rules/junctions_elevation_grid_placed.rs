use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
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

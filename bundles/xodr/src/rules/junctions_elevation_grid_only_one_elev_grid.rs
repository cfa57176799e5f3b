use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
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

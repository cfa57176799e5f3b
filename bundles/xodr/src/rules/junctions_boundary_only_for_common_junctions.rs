use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
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

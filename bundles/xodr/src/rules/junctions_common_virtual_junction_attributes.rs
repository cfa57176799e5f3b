use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.5.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let kind = match junction.kind() {
            None | Some(JunctionType::Virtual) => continue,
            Some(kind) => kind,
        };
        for name in ["mainRoad", "orientation", "sStart", "sEnd"] {
            if let Some(attribute) = junction.node().attribute(name) {
                let text = format!(
                    "junction `{}` of type `{}` has the attribute `{name}`; only virtual junctions may have it",
                    junction.id(),
                    kind.as_str()
                );
                found.issue(attribute, text);
            }
        }
    }
}

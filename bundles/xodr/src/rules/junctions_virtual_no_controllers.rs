use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.5.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if junction.kind() != Some(JunctionType::Virtual) {
            continue;
        }
        for controller in junction.controllers() {
            let text = format!(
                "virtual junction `{}` has controller `{}`; virtual junctions must not have controllers and \
                 therefore cannot have traffic lights",
                junction.id(),
                controller.id().unwrap_or_default()
            );
            found.issue(controller.node(), text);
        }
    }
}

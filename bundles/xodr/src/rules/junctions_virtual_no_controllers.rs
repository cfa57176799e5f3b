use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_virtual_no_controllers",
    uids: &["asam.net:xodr:1.9.0:junctions.virtual.no_controllers"],
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.5.0" },
    after: super::READABLE,
    page: include_str!("junctions_virtual_no_controllers.md"),
    run,
    ..Rule::DEFAULTS
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

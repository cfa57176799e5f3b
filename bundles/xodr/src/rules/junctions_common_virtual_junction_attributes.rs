use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_common_virtual_junction_attributes",
    uids: &["asam.net:xodr:1.5.0:junctions.common.virtual_junction_attributes"],
    versions: "1.5.0..",
    after: super::READABLE,
    page: include_str!("junctions_common_virtual_junction_attributes.md"),
    run,
    ..Rule::DEFAULTS
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

use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_common_junctions_no_pred_succ",
    uids: &["asam.net:xodr:1.4.0:junctions.common.junctions_no_pred_succ"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("junctions_common_junctions_no_pred_succ.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let links = junction.node().children();
        for link in
            links.filter(|child| matches!(child.name(), "link" | "predecessor" | "successor"))
        {
            let text = format!(
                "junction `{}` has an element `{}`; junctions have no predecessor and no successor; roads are \
                 linked to junctions",
                junction.id(),
                link.name()
            );
            found.issue(link, text);
        }
    }
}

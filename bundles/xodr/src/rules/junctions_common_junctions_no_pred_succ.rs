use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
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

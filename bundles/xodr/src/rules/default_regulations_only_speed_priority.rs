use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

/// Elements that are allowed in any element.
const ANYWHERE: [&str; 3] = ["userData", "include", "dataQuality"];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let header = map.header().into_iter();
    let defaults = header.flat_map(|header| header.children_named("defaultRegulations"));
    let regulations = defaults.flat_map(|defaults| defaults.children());
    let semantics = regulations.flat_map(|regulation| regulation.children_named("semantics"));
    for element in semantics.flat_map(|semantics| semantics.children()) {
        let name = element.name();
        if matches!(name, "speed" | "priority") || ANYWHERE.contains(&name) {
            continue;
        }
        let text = format!(
            "`{name}` is used in the default regulations; only `speed` and `priority` may be used there"
        );
        found.issue(element, text);
    }
}

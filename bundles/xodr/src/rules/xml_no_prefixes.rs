use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Elements at the top of a map and in its roads.
const ELEMENTS: [&str; 11] = [
    "header",
    "road",
    "junction",
    "controller",
    "junctionGroup",
    "station",
    "link",
    "planView",
    "lanes",
    "connection",
    "laneSection",
];

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    let parts = ELEMENTS
        .iter()
        .filter_map(|name| document.elements(name).next());
    let mut all = std::iter::once(root).chain(parts.filter(|node| !is_user_data(*node)));
    let Some(node) = all.find(|node| !node.prefix().is_empty()) else {
        return;
    };
    let (prefix, name) = (node.prefix(), node.name());
    let text = format!(
        "the element is named `{prefix}:{name}`; write `{name}` without a prefix, because many readers compare whole \
         names and then find no map"
    );
    found.issue(node, text);
}

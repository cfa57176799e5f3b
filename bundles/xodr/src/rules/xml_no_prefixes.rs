use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Further elements of which the first one is looked at.
const ELEMENTS: [&str; 3] = ["laneSection", "geometry", "laneLink"];

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    let Some(root) = document.root() else { return };
    let tops = root.children().filter(|node| !is_user_data(*node));
    let tops = tops.flat_map(|top| std::iter::once(top).chain(top.children()));
    let further = ELEMENTS
        .iter()
        .filter_map(|name| document.elements(name).next());
    let all = std::iter::once(root).chain(tops).chain(further);
    let mut all = all.filter(|node| !is_user_data(*node));
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

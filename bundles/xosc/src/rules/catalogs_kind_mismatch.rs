use crate::families::catalogs;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (reference, to) in catalogs::references(scenario) {
        let Resolution::OtherElement(entry) = to else {
            continue;
        };
        let parent = reference.node().parent();
        let kinds = catalogs::kinds(reference).iter();
        let text = format!(
            "the entry `{}` is a `{}`, but `{}` requires {}",
            entry.node.attr("name").unwrap_or(""),
            entry.node.name(),
            parent.map_or("", |parent| parent.name()),
            catalogs::listed(kinds.map(|kind| kind.element())).replace(", ", " or ")
        );
        found
            .about(reference, "entryName", text)
            .at(entry.node, "the entry");
    }
}

use crate::families::catalogs;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_catalogs_kind_mismatch",
    uids: &["qcbus.dev:xosc:1.0.0:catalogs.kind_mismatch"],
    after: super::READABLE,
    page: include_str!("catalogs_kind_mismatch.md"),
    run,
    ..Rule::DEFAULTS
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

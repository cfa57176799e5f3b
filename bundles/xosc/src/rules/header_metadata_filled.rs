use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_header_metadata_filled",
    uids: &["qcbus.dev:xosc:1.0.0:header.metadata_filled"],
    level: Level::Information,
    after: super::READABLE,
    page: include_str!("header_metadata_filled.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(header) = scenario.root().child("FileHeader") else {
        return;
    };
    for (attribute, what) in [
        ("description", "the purpose of the file"),
        ("author", "the person to contact"),
    ] {
        if header
            .text(attribute)
            .is_some_and(|text| text.trim().is_empty())
        {
            let text = format!("the header's `{attribute}` is empty; it should state {what}");
            found.issue(Place::attribute_or_node(header.node(), attribute), text);
        }
    }
}

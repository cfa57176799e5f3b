use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.1..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(header) = scenario.root().child("FileHeader") else {
        return;
    };
    let Some(license) = header.child("License") else {
        let text =
            "the header has no `License`; it should state under which terms the file may be used";
        found.issue(header.node(), text);
        return;
    };
    let named = license
        .text("spdxId")
        .is_none_or(|id| !id.trim().is_empty());
    if !license.has("spdxId") || !named {
        let text = "the `License` has no `spdxId`, such as `MIT` or `CC-BY-4.0`, by which programs identify it";
        found.issue(Place::attribute_or_node(license.node(), "spdxId"), text);
    }
}

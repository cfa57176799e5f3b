use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_shadowing",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.shadowing"],
    level: Level::Information,
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("parameters_shadowing.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for block in scenario.elements("ParameterDeclarations") {
        let Some(holder) = block.parent() else {
            continue;
        };
        let Some(around) = holder.parent() else {
            continue;
        };
        for declaration in holder.declarations() {
            let Some(outer) = around.parameter(declaration.name) else {
                continue;
            };
            let value = declaration.node.attr("value").unwrap_or("");
            if bare(value) == declaration.name && value.starts_with('$') {
                // The outer value is passed on intentionally.
                continue;
            }
            let text = format!(
                "the parameter `{}` hides another parameter of this name within `{}`",
                declaration.name,
                holder.name()
            );
            found
                .issue(declaration.node, text)
                .at(outer.node, "the hidden parameter");
        }
    }
}

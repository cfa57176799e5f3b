use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
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

use crate::families::declared;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !scenario.storyboard().is_complete() {
        return;
    }
    let declared = declared::VARIABLES.by_name(scenario);
    let written = declared::VARIABLES.names(scenario, &["VariableAction"]);
    let dangling = declared::VARIABLES.dangling(scenario, &["VariableAction"]);
    for (condition, name) in declared::VARIABLES.references(scenario, &["VariableCondition"]) {
        let Some(declaration) = declared.get(&*name).filter(|_| !written.contains(&name)) else {
            continue;
        };
        if dangling.may_mean(&name) {
            continue;
        }
        let text = format!(
            "no action sets the variable `{name}`; unless it is set from outside, it keeps its declared value \
             and the condition never changes"
        );
        found
            .about(condition, "variableRef", text)
            .at(declaration.node(), "its declaration");
    }
}

use crate::families::declared;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

/// Elements that use a variable.
const USES: &[&str] = &["VariableAction", "VariableCondition"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !scenario.storyboard().is_complete() {
        return;
    }
    let used = declared::VARIABLES.names(scenario, USES);
    let dangling = declared::VARIABLES.dangling(scenario, USES);
    for declaration in declared::VARIABLES.declarations(scenario) {
        let name = bare(declaration.written("name").unwrap_or(""));
        if !used.contains(name) && !dangling.may_mean(name) {
            let text = format!(
                "no action sets the variable `{name}`, and no condition reads it; it can be used only from \
                 outside"
            );
            found.issue(declaration.node(), text);
        }
    }
}

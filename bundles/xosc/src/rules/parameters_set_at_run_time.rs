use crate::families::declared;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !scenario.storyboard().is_complete() {
        return;
    }
    let mut read = HashSet::new();
    for (_, name) in declared::PARAMETERS.references(scenario, &["ParameterCondition"]) {
        // A condition about an unknown parameter may mean any of them.
        if scenario.root().parameter(&name).is_none() {
            return;
        }
        read.insert(name);
    }
    for (action, name) in declared::PARAMETERS.references(scenario, &["ParameterAction"]) {
        let is_declared = scenario.root().parameter(&name).is_some();
        if !is_declared || read.contains(&name) {
            continue;
        }
        let text = format!(
            "the action sets the parameter `{name}`, but nothing reads it afterwards: `${name}` is replaced when the \
             file is loaded, and no `ParameterCondition` refers to it"
        );
        found.about(action, "parameterRef", text);
    }
}

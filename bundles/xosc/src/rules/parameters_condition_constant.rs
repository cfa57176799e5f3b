use crate::families::constraints;
use crate::families::declared;
use crate::families::values;
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
    let changed = declared::PARAMETERS.names(scenario, &["ParameterAction"]);
    let dangling = declared::PARAMETERS.dangling(scenario, &["ParameterAction"]);
    for (element, name) in declared::PARAMETERS.references(scenario, &["ParameterCondition"]) {
        let declaration = scenario.root().parameter(&name);
        let Some(declaration) = declaration.filter(|_| !changed.contains(&name)) else {
            continue;
        };
        if dangling.may_mean(&name) {
            continue;
        }
        let outcome = outcome(element, declaration)
            .map(|holds| format!("; with the declared value the condition is always {holds}"));
        let text = format!(
            "no `ParameterAction` changes the parameter `{name}`, so it keeps its value throughout the run{}",
            outcome.unwrap_or_default()
        );
        found.about(element, "parameterRef", text);
    }
}

/// Returns the result of the condition with the declared value.
fn outcome(condition: Element<'_, '_>, declaration: &Declaration<'_>) -> Option<bool> {
    let Declared::Value(value) = &declaration.declared else {
        return None;
    };
    let data_type = declaration.data_type?;
    let other = values::typed(condition, "value", data_type)?.ok()?;
    let (left, right) = (
        constraints::Operand::new(value, data_type)?,
        constraints::Operand::new(&other, data_type)?,
    );
    left.holds(constraints::Comparison::of(condition)?, &right)
}

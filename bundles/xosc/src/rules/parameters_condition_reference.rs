use crate::families::declared;
use crate::families::references;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    let declared = declared::PARAMETERS.by_name(scenario);
    let references =
        declared::PARAMETERS.references(scenario, &["ParameterAction", "ParameterCondition"]);
    for (element, name) in references {
        if declared.contains_key(&*name) {
            continue;
        }
        if let Some(inner) = element.parameter(&name) {
            let text = format!(
                "`{}` refers to the parameter `{name}`, which is not declared at the top of the scenario but \
                 further inside; only parameters at the top are certain to be found",
                element.name()
            );
            found
                .about(element, "parameterRef", text)
                .level(Level::Warning)
                .at(inner.node, "its declaration");
        } else if is_criterion(element) {
            let text = format!(
                "the parameter `{name}` of this criterion is not a parameter of the scenario; conditions whose \
                 name begins with `criteria_` are read only by CARLA's ScenarioRunner"
            );
            found
                .about(element, "parameterRef", text)
                .level(Level::Information);
        } else {
            let names = declared.keys().copied();
            references::unresolved(element, "parameterRef", &name, "parameter", names, found);
        }
    }
}

/// Checks whether the condition is a criterion by which CARLA's ScenarioRunner judges a run.
fn is_criterion(element: Element<'_, '_>) -> bool {
    let condition = element.ancestor("Condition");
    let name = condition.and_then(|condition| condition.text("name"));
    name.is_some_and(|name| name.starts_with("criteria_"))
}

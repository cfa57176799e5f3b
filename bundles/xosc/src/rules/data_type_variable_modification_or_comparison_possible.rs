use crate::families::constraints;
use crate::families::declared;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let declared = declared::VARIABLES.by_name(scenario);
    let type_of = |name: &str| {
        let declaration = declared.get(name)?;
        declared::type_of(*declaration, "variableType")
    };
    for (action, name) in declared::VARIABLES.references(scenario, &["VariableAction"]) {
        let modification = action.path(&["ModifyAction", "Rule"]);
        let data_type = type_of(&name).filter(|data_type| !data_type.is_numeric());
        let Some((rule, data_type)) = modification.zip(data_type) else {
            continue;
        };
        let how = if rule.child("MultiplyByValue").is_some() {
            "multiplied"
        } else {
            "added to"
        };
        let text = format!(
            "the variable `{name}` is of type `{}` and cannot be {how}, because only numbers can; use \
             `SetAction` to set it",
            data_type.word()
        );
        found.about(action, "variableRef", text);
    }
    for (condition, name) in declared::VARIABLES.references(scenario, &["VariableCondition"]) {
        let comparison = constraints::Comparison::of(condition).filter(|one| one.is_order());
        let data_type = type_of(&name).filter(|data_type| !data_type.is_ordered());
        let Some((comparison, data_type)) = comparison.zip(data_type) else {
            continue;
        };
        let text = format!(
            "the variable `{name}` is of type `{}`, whose values have no order for `{}`; use `equalTo` or \
             `notEqualTo`",
            data_type.word(),
            comparison.word()
        );
        found.about(condition, "rule", text);
    }
}

use crate::families::constraints;
use crate::families::declared;
use crate::families::values;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for declaration in scenario.elements("ParameterDeclaration") {
        let Some(data_type) = declared::type_of(declaration, "parameterType") else {
            continue;
        };
        for group in constraints::groups(declaration, data_type) {
            for constraint in group.constraints {
                let element = constraint.element;
                if let Some(Err(text)) = values::typed(element, "value", data_type) {
                    found.about(element, "value", text);
                }
                let ordering = constraint.comparison.filter(|one| one.is_order());
                if let Some(comparison) = ordering.filter(|_| !data_type.is_ordered()) {
                    let text = format!(
                        "`{}` compares by order, but values of type `{}` have no order; use `equalTo` or \
                         `notEqualTo`",
                        comparison.word(),
                        data_type.word()
                    );
                    found.about(element, "rule", text).level(Level::Warning);
                }
            }
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (name, attribute) in [
        ("ParameterDeclaration", "parameterType"),
        ("VariableDeclaration", "variableType"),
    ] {
        for declaration in scenario.elements(name) {
            if declaration.written(attribute) == Some("integer") {
                let text = format!(
                    "`{attribute}` is `integer`, which is deprecated since 1.2; use `int` instead"
                );
                found.about(declaration, attribute, text);
            }
        }
    }
}

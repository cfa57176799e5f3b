use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_type_literal_version",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.type_literal_version"],
    level: Level::Information,
    versions: "1.2.0..",
    after: super::READABLE,
    page: include_str!("parameters_type_literal_version.md"),
    run,
    ..Rule::DEFAULTS
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

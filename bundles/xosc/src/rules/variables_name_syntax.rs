use crate::families::declared;
use crate::prelude::*;
use qcbus_openscenario::is_identifier;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_variables_name_syntax",
    uids: &["qcbus.dev:xosc:1.0.0:variables.name_syntax"],
    level: Level::Warning,
    versions: "1.2.0..",
    after: super::READABLE,
    page: include_str!("variables_name_syntax.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let parameters = declared::PARAMETERS.by_name(scenario);
    for declaration in declared::VARIABLES.declarations(scenario) {
        let Some(name) = declaration.written("name") else {
            continue;
        };
        if !is_identifier(name) {
            let text = format!(
                "`{name}` is not a valid variable name; it should be a letter or `_`, followed by letters, \
                 digits and `_`"
            );
            found.about(declaration, "name", text);
        } else if let Some(parameter) = parameters.get(name) {
            let text = format!(
                "a parameter is also named `{name}`; `${name}` means the parameter, `variableRef` the variable, \
                 and readers confuse the two"
            );
            found
                .about(declaration, "name", text)
                .at(parameter.node(), "the parameter");
        }
    }
}

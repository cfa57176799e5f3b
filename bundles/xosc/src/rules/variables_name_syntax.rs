use crate::families::declared;
use crate::prelude::*;
use qcbus_openscenario::is_identifier;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
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

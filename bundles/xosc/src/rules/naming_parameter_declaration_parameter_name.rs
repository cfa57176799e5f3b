use crate::prelude::*;
use qcbus_openscenario::is_identifier;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for declaration in scenario.elements("ParameterDeclaration") {
        let Some(name) = declaration
            .written("name")
            .filter(|name| !is_identifier(name))
        else {
            continue;
        };
        let (level, why) = match name.strip_prefix('$') {
            // Many files have the `$`, and most simulators remove it.
            Some(rest) if is_identifier(rest) => (
                Level::Warning,
                format!("the `$` belongs where the parameter is used; declare it as `{rest}`"),
            ),
            _ => (
                Level::Error,
                "a name must begin with a letter or `_` and continue with letters, digits and `_`; otherwise no \
                 `$` can refer to it"
                    .to_owned(),
            ),
        };
        let text = format!("`{name}` is not a valid parameter name: {why}");
        found.about(declaration, "name", text).level(level);
    }
}

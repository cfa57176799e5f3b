use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for declaration in scenario.elements("ParameterDeclaration") {
        let name = bare(declaration.written("name").unwrap_or(""));
        if name.starts_with("OSC") {
            let text = format!(
                "the parameter is named `{name}`, but names that begin with `OSC` are reserved for the standard"
            );
            found.about(declaration, "name", text);
        }
    }
}

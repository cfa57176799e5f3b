use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_naming_parameter_declaration_name_prefix_reserved",
    uids: &["asam.net:xosc:1.0.0:naming.parameter_declaration_name_prefix_reserved"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("naming_parameter_declaration_name_prefix_reserved.md"),
    run,
    ..Rule::DEFAULTS
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

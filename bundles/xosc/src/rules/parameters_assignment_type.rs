use crate::families::{allowed_values, catalogs};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (assignment, _, text) in scenario.assignment_faults() {
        let name = bare(assignment.written("parameterRef").unwrap_or(""));
        let text = format!("the value for `{name}` is invalid: {text}");
        // If the default does not fit either, the type is wrong. This is a fault of the catalog.
        match misdeclared(assignment, name) {
            Some(declaration) => found
                .about(assignment, "value", text)
                .level(Level::Warning)
                .at(
                    declaration,
                    "the declaration; its own value does not match its type either",
                ),
            None => found.about(assignment, "value", text),
        };
    }
    constraints(scenario, found);
}

/// Returns the declaration of a parameter if its declared value is not of its type.
fn misdeclared<'d>(assignment: Element<'_, 'd>, name: &str) -> Option<Node<'d>> {
    let reference = assignment.parent()?.parent()?;
    let entry = assignment.scenario().entry(reference)?;
    let declaration = entry.declaration(name)?;
    let default = declaration.node.attr("value")?;
    let fits = default.contains('$') || declaration.data_type?.parse(default).is_some();
    (!fits).then_some(declaration.node)
}

/// Reports values of the right type that the entry does not allow.
fn constraints(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (reference, _) in catalogs::references(scenario) {
        let Some(entry) = scenario.entry(reference) else {
            continue;
        };
        for assignment in reference.assignments() {
            let name = bare(assignment.written("parameterRef").unwrap_or(""));
            let Some(declaration) = entry.declaration(name) else {
                continue;
            };
            let Declared::Value(value) = &declaration.declared else {
                continue;
            };
            let block = entry.child("ParameterDeclarations").into_iter();
            let node = block
                .flat_map(|block| block.children_named("ParameterDeclaration"))
                .find(|one| one.node() == declaration.node);
            let Some(allowed) = node.and_then(|node| allowed_values::violated(node, value)) else {
                continue;
            };
            let text = format!(
                "the value for `{name}` is `{}`, but the entry allows only {allowed}",
                value.text()
            );
            found
                .about(assignment, "value", text)
                .at(declaration.node, "the declaration");
        }
    }
}

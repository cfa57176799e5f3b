use crate::families::catalogs;
use crate::families::references::hint;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (reference, _) in catalogs::references(scenario) {
        let Some(entry) = scenario.entry(reference) else {
            continue;
        };
        for assignment in reference.assignments() {
            let Some(written) = assignment.written("parameterRef") else {
                continue;
            };
            let name = bare(written);
            if entry.declaration(name).is_none() {
                let names = entry.declarations().iter().map(|one| one.name);
                let near = hint(name, names.clone());
                let what = match entry.declarations().len() {
                    0 => "; it declares none".to_owned(),
                    _ if near.is_empty() => format!("; it declares {}", catalogs::listed(names)),
                    _ => near,
                };
                let text = format!(
                    "the entry `{}` has no parameter `{name}`{what}",
                    reference.text("entryName").unwrap_or_default()
                );
                found
                    .about(assignment, "parameterRef", text)
                    .at(entry.node(), "the entry");
            } else if written != name {
                let text = format!(
                    "`parameterRef` names the parameter `{name}` and does not use its value; write the name \
                     without `$`"
                );
                found
                    .about(assignment, "parameterRef", text)
                    .level(Level::Warning);
            }
        }
    }
}

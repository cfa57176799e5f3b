use crate::families::references;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    // A catalog has no entities. They are checked in the scenario that refers to it.
    if scenario.form() != Form::Scenario {
        return;
    }
    let entities = scenario.entities();
    for (element, attribute) in references::entity_references() {
        for reference in scenario.elements_everywhere(element) {
            let Some(name) = reference.text(attribute) else {
                continue;
            };
            // Catalogs have parameters for optional trailers of a vehicle. An empty value means no
            // trailer.
            let left_out = name.is_empty() && reference.written(attribute) != Some("");
            if !left_out && !entities.contains(&name) {
                let names = entities.names();
                references::unresolved(reference, attribute, &name, "entity", names, found);
            }
        }
    }
}

use crate::families::references;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_resolvable_entity_references",
    uids: &["asam.net:xosc:1.2.0:reference_control.resolvable_entity_references"],
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("reference_control_resolvable_entity_references.md"),
    run,
    ..Rule::DEFAULTS
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

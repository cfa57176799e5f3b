use std::borrow::Cow;
use std::cell::LazyCell;

use crate::families::references;
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let is_whole = scenario.form() == Form::Scenario && scenario.storyboard().is_complete();
    if !is_whole || scenario.root().child("Storyboard").is_none() {
        return;
    }
    let mut used: HashSet<Cow<'_, str>> = HashSet::default();
    for (element, attribute) in references::entity_references() {
        for reference in scenario.elements_everywhere(element) {
            if !reference.has(attribute) {
                continue;
            }
            let Some(name) = reference.text(attribute) else {
                return;
            };
            used.insert(name);
        }
    }
    let dangling = LazyCell::new(|| references::dangling_entities(scenario));
    let is_unused = |name: &str| !used.contains(name) && !dangling.may_mean(name);
    let entities = scenario.entities();
    let by_type = entities
        .selections()
        .iter()
        .any(|selection| selection.types().next().is_some());
    for object in entities.objects() {
        let element = object.element(scenario);
        // Vehicles and pedestrians must at least be placed. Another rule checks this.
        let is_other = matches!(object.kind(), EntityKind::MiscObject | EntityKind::External);
        if is_other && !by_type && !element.is("Trailer") && is_unused(object.name()) {
            let text = format!("nothing refers to the entity `{}`", object.name());
            found.about(element, "name", text);
        }
    }
    for selection in entities.selections() {
        if is_unused(selection.name()) {
            let text = format!("nothing refers to the selection `{}`", selection.name());
            found.about(selection.element(scenario), "name", text);
        }
    }
}

use crate::families::references::{SINGLE_ENTITY, quoted};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

/// Elements in which an `EntityRef` refers to one entity.
const AROUND: [&str; 2] = ["CollisionCondition", "TimeToCollisionConditionTarget"];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.entities().selections().is_empty() {
        return;
    }
    for (element, attribute) in SINGLE_ENTITY {
        for reference in scenario.elements_everywhere(element) {
            look(reference, attribute, found);
        }
    }
    for reference in scenario.elements_everywhere("EntityRef") {
        let parent = reference.node().parent().map_or("", |parent| parent.name());
        if AROUND.contains(&parent) {
            look(reference, "entityRef", found);
        }
    }
}

fn look(reference: Element<'_, '_>, attribute: &str, found: &mut Sink<'_>) {
    let scenario = reference.scenario();
    let Some(name) = reference.text(attribute) else {
        return;
    };
    let Some(selection) = scenario.entities().selection(&name) else {
        return;
    };
    if scenario.entities().object(&name).is_some() {
        return;
    }
    // With one member the intended entity is clear.
    let clear = scenario
        .entities()
        .expand(&name)
        .is_some_and(|members| members.len() == 1);
    let level = if clear { Level::Warning } else { Level::Error };
    let what = match reference.name() {
        "EntityRef" => reference.node().parent().map_or("", |parent| parent.name()),
        name => name,
    };
    let text = format!(
        "`{what}` refers to the selection {}, but needs a single entity",
        quoted(reference, attribute, &name)
    );
    found
        .about(reference, attribute, text)
        .level(level)
        .at(selection.element(scenario).node(), "the selection");
}

use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let entities = scenario.entities();
    let objects = entities.objects().iter();
    let objects = objects.map(|object| (object.name(), object.element(scenario)));
    let selections = entities.selections().iter();
    let selections = selections.map(|selection| (selection.name(), selection.element(scenario)));
    let mut first: HashMap<&str, Element<'_, '_>> = HashMap::default();
    for (name, element) in objects.chain(selections) {
        let known = *first.entry(name).or_insert(element);
        if known == element || is_said_elsewhere(known, element) {
            continue;
        }
        let text = format!(
            "the name {} is already used by a `{}`; names of entities and selections must be unique",
            quoted(element, "name", name),
            known.name()
        );
        found
            .about(element, "name", text)
            .at(known.node(), "the element that already has the name");
    }
}

/// Checks whether another rule reports it. Equal written names of siblings are found there.
fn is_said_elsewhere(one: Element<'_, '_>, other: Element<'_, '_>) -> bool {
    one.node().parent() == other.node().parent() && one.written("name") == other.written("name")
}

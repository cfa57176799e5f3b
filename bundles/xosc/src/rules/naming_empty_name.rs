use crate::families::names;
use crate::families::references::quoted;
use crate::prelude::*;
use qcbus_openscenario::StoryKind;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (element, name) in names::keys(scenario) {
        if name.trim().is_empty() {
            let text = format!(
                "the name of this `{}` is empty, so nothing can refer to it",
                element.name()
            );
            let level = if may_be_nameless(element) {
                Level::Warning
            } else {
                Level::Error
            };
            found.about(element, "name", text).level(level);
        } else if name.trim() != name {
            let text = format!(
                "the name {} has leading or trailing white space, which is part of the name; references must \
                 contain it as well",
                quoted(element, "name", &name)
            );
            found.about(element, "name", text).level(Level::Warning);
        }
    }
}

/// Checks whether the name is optional, because an element that is never referred to needs none.
fn may_be_nameless(element: Element<'_, '_>) -> bool {
    let in_catalog = element
        .node()
        .parent()
        .is_some_and(|parent| parent.is("Catalog"));
    !in_catalog && (StoryKind::of_element(element.name()).is_some() || element.is("Phase"))
}

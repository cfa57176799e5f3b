//! The minimum subset of the standard for the exchange between any two tools. Each rule states
//! which part of it is allowed. These rules run only on request.

use crate::prelude::*;

/// Reports every element of these names, because the subset has none of them. `instead` is the
/// alternative.
pub(crate) fn none(scenario: &Scenario<'_>, names: &[&str], instead: &str, found: &mut Sink<'_>) {
    for element in names.iter().flat_map(|name| scenario.elements(name)) {
        outside(element, instead, found);
    }
}

/// Reports that an element is outside the subset.
pub(crate) fn outside(element: Element<'_, '_>, instead: &str, found: &mut Sink<'_>) {
    let text = format!(
        "`{}` is outside the minimum subset: {instead}",
        element.name()
    );
    found.issue(element.node(), text);
}

/// Reports the children of an element that the subset does not allow there.
pub(crate) fn only(around: Element<'_, '_>, allowed: &[&str], found: &mut Sink<'_>) {
    for child in around.children() {
        if !allowed.contains(&child.name()) {
            let text = format!(
                "`{}` in `{}` is outside the minimum subset, which allows only {} there",
                child.name(),
                around.name(),
                list(allowed)
            );
            found.issue(child.node(), text);
        }
    }
}

/// Reports the attributes of an element that the subset excludes.
pub(crate) fn without(
    scenario: &Scenario<'_>,
    element: &str,
    attributes: &[&str],
    found: &mut Sink<'_>,
) {
    for element in scenario.elements(element) {
        for attribute in attributes {
            if element.has(attribute) {
                let text = format!(
                    "`{attribute}` of `{}` is outside the minimum subset, which allows only the attributes that \
                     the standard requires",
                    element.name()
                );
                found.issue(Place::attribute_or_node(element.node(), attribute), text);
            }
        }
    }
}

fn list(names: &[&str]) -> String {
    let quoted: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    quoted.join(", ")
}

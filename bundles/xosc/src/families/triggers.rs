//! Triggers: what starts and what stops, and when at the earliest.

use std::fmt::Write as _;

use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::Sink;

use crate::model::About;

/// Says which elements of a name that matter have a `StartTrigger` without any condition.
pub(crate) fn empty_starts<'d>(
    scenario: &Scenario<'d>,
    owner: &str,
    matters: fn(Element<'_, 'd>) -> bool,
    remedy: &str,
    found: &mut Sink<'_>,
) {
    for element in scenario.elements_everywhere(owner) {
        let Some(trigger) = element.child("StartTrigger") else {
            continue;
        };
        if trigger.children().next().is_none() && matters(element) {
            let text = format!(
                "the `StartTrigger` of {} is empty: without a condition it is never true, so it does not start, \
                 while some simulators start it at once; {remedy}",
                called(element)
            );
            found.about(trigger, "", text);
        }
    }
}

/// An element with its name, for texts: "the act `Drive`".
pub(crate) fn called(element: Element<'_, '_>) -> String {
    let own = format!("`{}`", element.name());
    let kind = match element.name() {
        "Story" => "story",
        "Act" => "act",
        "ManeuverGroup" => "maneuver group",
        "Maneuver" => "maneuver",
        "Event" => "event",
        "Action" => "action",
        _ => &own,
    };
    match element.text("name") {
        Some(name) => format!("the {kind} `{name}`"),
        None => format!("this {kind}"),
    }
}

/// The conditions of a trigger, group by group.
pub(crate) fn groups<'m, 'd>(
    trigger: Element<'m, 'd>,
) -> impl Iterator<Item = Vec<Element<'m, 'd>>> {
    trigger
        .children_named("ConditionGroup")
        .map(|group| group.children_named("Condition").collect())
}

/// The `SimulationTimeCondition` of a condition.
pub(crate) fn time<'m, 'd>(condition: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    condition.path(&["ByValueCondition", "SimulationTimeCondition"])
}

/// The time at which a condition about the simulation time becomes true at the earliest, its delay
/// included; `None` when it is about something else or not known.
pub(crate) fn earliest(condition: Element<'_, '_>) -> Option<f64> {
    let time = time(condition)?;
    let value = time.number("value")?;
    let delay = condition.number("delay").unwrap_or(0.0).max(0.0);
    match &*time.word("rule")? {
        "greaterThan" | "greaterOrEqual" | "equalTo" => Some(value + delay),
        _ => None,
    }
}

/// An element with all that matters of it as one text: what has the same text means the same. Names
/// of conditions say nothing.
pub(crate) fn canonical(element: Element<'_, '_>) -> String {
    canonical_but(element, &[])
}

/// Like [`canonical`], without some of the element's own attributes.
pub(crate) fn canonical_but(element: Element<'_, '_>, without: &[&str]) -> String {
    let mut text = String::new();
    write_canonical(element, without, DEEPEST, &mut text);
    text
}

/// Conditions are a few levels deep; what lies deeper than this is no condition of the standard.
const DEEPEST: usize = 64;

fn write_canonical(element: Element<'_, '_>, without: &[&str], deep: usize, out: &mut String) {
    let Some(deeper) = deep.checked_sub(1) else {
        return;
    };
    let mut attributes: Vec<(&str, String)> = Vec::new();
    for attribute in element.node().attributes() {
        let name = attribute.name();
        if (element.is("Condition") && name == "name") || without.contains(&name) {
            continue;
        }
        let value = match element.number(name) {
            Some(number) => number.to_string(),
            None => match element.word(name) {
                Some(word) => word.into_owned(),
                None => attribute.value().to_owned(),
            },
        };
        attributes.push((name, value));
    }
    attributes.sort();
    let _ = write!(out, "<{}", element.name());
    for (name, value) in attributes {
        let _ = write!(out, " {name}={value:?}");
    }
    out.push('>');
    for child in element.children() {
        write_canonical(child, &[], deeper, out);
    }
    out.push_str("</>");
}

/// The events of an act, those of maneuvers in catalogs among them.
pub(crate) fn events<'m, 'd>(act: Element<'m, 'd>) -> impl Iterator<Item = Element<'m, 'd>> {
    maneuvers(act)
        .filter_map(|child| match child.name() {
            "CatalogReference" => child.scenario().entry(child),
            _ => Some(child),
        })
        .flat_map(|maneuver| maneuver.children_named("Event"))
}

/// The maneuvers of an act, and its references to maneuvers in catalogs.
pub(crate) fn maneuvers<'m, 'd>(act: Element<'m, 'd>) -> impl Iterator<Item = Element<'m, 'd>> {
    act.children_named("ManeuverGroup")
        .flat_map(Element::children)
        .filter(|child| child.is("Maneuver") || child.is("CatalogReference"))
}

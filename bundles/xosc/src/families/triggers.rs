//! Triggers: start and stop conditions, and their earliest time.

use crate::families::timeline;
use std::borrow::Cow;
use std::fmt::Write as _;
use std::hash::BuildHasher as _;

use crate::prelude::*;
use foldhash::HashMap;
use qcbus_openscenario::Reading;
use qcbus_openscenario::parse_double;

pub(crate) use qcbus_openscenario::story::{edge_of_time, time};
pub(crate) use qcbus_openscenario::wording::called;

/// Reports the elements of a name that matter and have a `StartTrigger` without any condition.
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
                "the `StartTrigger` of {} is empty; without a condition it is never true, so the element does \
                 not start, but some simulators start it at once; {remedy}",
                called(element)
            );
            found
                .about(trigger, "", text)
                .maybe_fault(timeline::start_of(element));
        }
    }
}

/// Returns the conditions of a trigger, group by group.
pub(crate) fn groups<'m, 'd>(
    trigger: Element<'m, 'd>,
) -> impl Iterator<Item = Vec<Element<'m, 'd>>> {
    trigger
        .children_named("ConditionGroup")
        .map(|group| group.children_named("Condition").collect())
}

/// Returns the `SimulationTimeCondition` or the `TimeOfDayCondition` of a condition.
pub(crate) fn time_or_day<'m, 'd>(condition: Element<'m, 'd>) -> Option<Element<'m, 'd>> {
    time(condition).or_else(|| condition.path(&["ByValueCondition", "TimeOfDayCondition"]))
}

/// Returns the earliest time at which a condition about the simulation time is true, including its
/// delay. Returns `None` if the condition is about something else, or the time is unknown.
pub(crate) fn earliest(condition: Element<'_, '_>) -> Option<f64> {
    let time = time_or_day(condition)?;
    let value = match time.is("TimeOfDayCondition") {
        true => time.scenario().simulation_time_of(time)?,
        false => time.number("value")?,
    };
    let delay = condition.number("delay").unwrap_or(0.0).max(0.0);
    match &*time.word("rule")? {
        "greaterThan" | "greaterOrEqual" | "equalTo" => Some(value + delay),
        _ => None,
    }
}

/// Checks whether a condition is true in the first or second step.
pub(crate) fn holds_at_once(condition: Element<'_, '_>) -> bool {
    let holds = || {
        let time = time(condition)?;
        let value = time.number("value")?;
        let delay = if condition.has("delay") {
            condition.number("delay")?
        } else {
            0.0
        };
        let edge = condition.word("conditionEdge")?;
        let holds = match &*time.word("rule")? {
            "greaterThan" | "greaterOrEqual" => value <= 0.0 && &*edge != "falling",
            "lessThan" => value > 0.0 && &*edge == "none",
            "lessOrEqual" => value >= 0.0 && &*edge == "none",
            "notEqualTo" => value < 0.0 && &*edge == "none",
            "equalTo" => value == 0.0 && &*edge == "none",
            _ => false,
        };
        Some(holds && delay <= 0.0)
    };
    holds().unwrap_or(false)
}

/// Returns an element with all its significant content as one text. Elements with the same text
/// mean the same. Names of conditions are left out.
pub(crate) fn canonical(element: Element<'_, '_>) -> String {
    canonical_but(element, &[])
}

/// Like [`canonical`], without some of the element's own attributes.
pub(crate) fn canonical_but(element: Element<'_, '_>, without: &[&str]) -> String {
    let mut text = String::new();
    write_canonical(element, without, DEEPEST, &mut text);
    text
}

/// Maximum depth of an element. Conditions have only a few levels. Anything deeper is no condition
/// of the standard.
const DEEPEST: usize = 64;

fn write_canonical(element: Element<'_, '_>, without: &[&str], deep: usize, out: &mut String) {
    let Some(deeper) = deep.checked_sub(1) else {
        return;
    };
    let mut attributes: Vec<(&str, Attribute<'_>)> = element
        .node()
        .attributes()
        .map(|attribute| (attribute.name(), attribute))
        .filter(|(name, _)| {
            !(without.contains(name) || (*name == "name" && element.is("Condition")))
        })
        .collect();
    attributes.sort_unstable_by_key(|(name, _)| *name);
    let _ = write!(out, "<{}", element.name());
    for (name, attribute) in attributes {
        let _ = write!(out, " {name}=");
        write_value(element, attribute, out);
    }
    out.push('>');
    for child in element.children() {
        write_canonical(child, &[], deeper, out);
    }
    out.push_str("</>");
}

/// Numbers of triggers. Triggers with the same meaning have the same number.
#[derive(Default)]
pub(crate) struct Kinds<'m, 'd> {
    /// Numbers by fingerprint. Nearly all triggers differ, so few full comparisons are needed.
    by_print: HashMap<u64, Vec<usize>>,
    firsts: Vec<Option<Element<'m, 'd>>>,
}

impl<'m, 'd> Kinds<'m, 'd> {
    /// Returns the number of a trigger. A missing trigger has its own number.
    pub(crate) fn of(&mut self, trigger: Option<Element<'m, 'd>>) -> usize {
        let print = trigger.map_or(0, |trigger| fingerprint(trigger, DEEPEST));
        let same = self.by_print.entry(print).or_default();
        let known = same.iter().find(|number| {
            let first = self.firsts.get(**number).copied().flatten();
            first.map(canonical) == trigger.map(canonical)
        });
        if let Some(number) = known {
            return *number;
        }
        let number = self.firsts.len();
        same.push(number);
        self.firsts.push(trigger);
        number
    }
}

/// Returns a hash that is equal for elements with an equal [`canonical`] text.
fn fingerprint(element: Element<'_, '_>, deep: usize) -> u64 {
    let hash = foldhash::fast::FixedState::default();
    let Some(deeper) = deep.checked_sub(1) else {
        return 0;
    };
    let is_condition = element.is("Condition");
    let attributes = element.node().attributes();
    let attributes = attributes
        .filter(|attribute| !(is_condition && attribute.is("name")))
        .map(|attribute| hash.hash_one((attribute.name(), plain(element, attribute))));
    let own = attributes.fold(0, u64::wrapping_add);
    element
        .children()
        .fold(hash.hash_one((element.name(), own)), |print, child| {
            hash.hash_one((print, fingerprint(child, deeper)))
        })
}

/// Form of a value for comparisons.
#[derive(Hash)]
enum Plain<'d> {
    Number(u64),
    Text(Cow<'d, str>),
}

fn plain<'d>(element: Element<'_, 'd>, attribute: Attribute<'d>) -> Plain<'d> {
    // Minus zero becomes zero.
    let number = |number: f64| Plain::Number((number + 0.0).to_bits());
    let text = match element.reading(attribute) {
        Reading::Literal(text) => Cow::Borrowed(text),
        Reading::Value(value) => match value.number() {
            Some(value) => return number(value),
            None => value.text(),
        },
        Reading::Absent | Reading::Unknown => Cow::Borrowed(attribute.value()),
    };
    match parse_double(&text) {
        Some(value) => number(value),
        None => match text {
            Cow::Borrowed(text) => Plain::Text(Cow::Borrowed(text.trim())),
            Cow::Owned(text) => Plain::Text(Cow::Owned(text.trim().to_owned())),
        },
    }
}

/// Writes a value so that only equal values have equal texts. Numbers are written by their bits,
/// texts with their length.
fn write_value<'d>(element: Element<'_, 'd>, attribute: Attribute<'d>, out: &mut String) {
    let _ = match plain(element, attribute) {
        Plain::Number(bits) => write!(out, "#{bits:x}"),
        Plain::Text(text) => write!(out, "{}:{text}", text.len()),
    };
}

/// Returns the events of an act, including those of maneuvers in catalogs.
pub(crate) fn events<'m, 'd>(act: Element<'m, 'd>) -> impl Iterator<Item = Element<'m, 'd>> {
    maneuvers(act)
        .filter_map(|child| match child.name() {
            "CatalogReference" => child.scenario().entry(child),
            _ => Some(child),
        })
        .flat_map(|maneuver| maneuver.children_named("Event"))
}

/// Returns the maneuvers of an act, and its references to maneuvers in catalogs.
pub(crate) fn maneuvers<'m, 'd>(act: Element<'m, 'd>) -> impl Iterator<Item = Element<'m, 'd>> {
    act.children_named("ManeuverGroup")
        .flat_map(Element::children)
        .filter(|child| child.is("Maneuver") || child.is("CatalogReference"))
}

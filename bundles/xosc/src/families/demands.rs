//! Demands of several conditions on the same quantity.

use crate::families::actions::stated;
use crate::families::references::quoted;
use crate::families::triggers::canonical_but;
use crate::prelude::*;

/// One end of a range.
#[derive(Clone)]
pub(crate) struct Bound<'m, 'd> {
    value: f64,
    /// Whether the value itself is allowed.
    closed: bool,
    /// The element that demands it.
    pub(crate) element: Element<'m, 'd>,
    /// The demand in words.
    pub(crate) wanted: String,
}

/// Demands on a quantity.
#[derive(Clone)]
pub(crate) struct Demand<'m, 'd> {
    low: Option<Bound<'m, 'd>>,
    high: Option<Bound<'m, 'd>>,
    word: Option<(String, Bound<'m, 'd>)>,
    attribute: &'static str,
}

/// Conditions about one of several words: the element, and the attribute with the word.
const WORDS: &[(&str, &str)] = &[
    ("TrafficSignalCondition", "state"),
    ("TrafficSignalControllerCondition", "phase"),
    ("StoryboardElementStateCondition", "state"),
];

/// Conditions that compare with a value that may be a text.
const TEXTS: &[&str] = &[
    "ParameterCondition",
    "VariableCondition",
    "UserDefinedValueCondition",
];

/// Returns the quantity that a condition is about, and the demand on it. Returns `None` if it is
/// about no quantity, or not about its value in the current step.
pub(crate) fn of<'m, 'd>(condition: Element<'m, 'd>) -> Option<(String, Demand<'m, 'd>)> {
    let edge = condition.word("conditionEdge")?;
    if !matches!(&*edge, "none" | "rising") {
        return None;
    }
    let delay = condition.number("delay").unwrap_or(0.0);
    let (leaf, about) = leaf(condition)?;
    let (claim, without) = match WORDS.iter().find(|(name, _)| leaf.is(name)) {
        Some((_, attribute)) => (word(leaf, attribute)?, *attribute),
        None => (value(leaf)?, "value"),
    };
    let same = canonical_but(leaf, &["rule", without]);
    Some((format!("{delay} {about} {same}"), claim))
}

/// Checks whether two conditions contradict each other.
pub(crate) fn contradict<'m, 'd>(one: Element<'m, 'd>, other: Element<'m, 'd>) -> bool {
    match (of(one), of(other)) {
        (Some((quantity, one)), Some((same, other))) => {
            quantity == same && one.against(&other).is_some()
        }
        _ => false,
    }
}

/// Returns the element that states the comparison, and the entities that it is about.
fn leaf<'m, 'd>(condition: Element<'m, 'd>) -> Option<(Element<'m, 'd>, String)> {
    if let Some(by_value) = condition.child("ByValueCondition") {
        return Some((by_value.children().next()?, String::new()));
    }
    let by_entity = condition.child("ByEntityCondition")?;
    let triggering = by_entity.child("TriggeringEntities")?;
    let entities = triggering.scenario().entities();
    let mut names = Vec::new();
    for reference in triggering.children_named("EntityRef") {
        names.push(reference.text("entityRef")?.into_owned());
    }
    names.sort();
    let one = matches!(names.as_slice(), [name] if entities.object(name).is_some());
    // One of several entities may meet this condition and another entity the other condition.
    if !one && triggering.word("triggeringEntitiesRule")? != "all" {
        return None;
    }
    let leaf = by_entity.child("EntityCondition")?.children().next()?;
    Some((leaf, names.join(" ")))
}

fn word<'m, 'd>(leaf: Element<'m, 'd>, attribute: &'static str) -> Option<Demand<'m, 'd>> {
    let word = leaf.word(attribute)?;
    // Transitions last for one step. In this step the state before or after them also holds.
    if word.ends_with("Transition") {
        return None;
    }
    let bound = Bound {
        value: 0.0,
        closed: true,
        element: leaf,
        wanted: quoted(leaf, attribute, &word),
    };
    Some(Demand {
        low: None,
        high: None,
        word: Some((word.to_lowercase(), bound)),
        attribute,
    })
}

fn value<'m, 'd>(leaf: Element<'m, 'd>) -> Option<Demand<'m, 'd>> {
    let rule = leaf.word("rule")?;
    let Some(value) = leaf.number("value") else {
        let text = leaf
            .text("value")
            .filter(|_| TEXTS.contains(&leaf.name()))?;
        let bound = Bound {
            value: 0.0,
            closed: true,
            element: leaf,
            wanted: quoted(leaf, "value", &text),
        };
        let word = (rule == "equalTo").then(|| (text.into_owned(), bound));
        return word.map(|word| Demand {
            low: None,
            high: None,
            word: Some(word),
            attribute: "value",
        });
    };
    let bound = |closed: bool, words: &str| Bound {
        value,
        closed,
        element: leaf,
        wanted: format!("{words} {}", stated(leaf, "value", value)),
    };
    let (low, high) = match &*rule {
        "greaterThan" => (Some(bound(false, "more than")), None),
        "greaterOrEqual" => (Some(bound(true, "at least")), None),
        "lessThan" => (None, Some(bound(false, "less than"))),
        "lessOrEqual" => (None, Some(bound(true, "at most"))),
        "equalTo" => (Some(bound(true, "exactly")), Some(bound(true, "exactly"))),
        _ => return None,
    };
    Some(Demand {
        low,
        high,
        word: None,
        attribute: "value",
    })
}

impl<'m, 'd> Demand<'m, 'd> {
    fn any(&self) -> Option<&Bound<'m, 'd>> {
        let ends = self.low.as_ref().or(self.high.as_ref());
        ends.or(self.word.as_ref().map(|(_, bound)| bound))
    }

    /// Returns the element that demands it.
    pub(crate) fn element(&self) -> Option<Element<'m, 'd>> {
        self.any().map(|bound| bound.element)
    }

    /// Returns the demand in words.
    pub(crate) fn wanted(&self) -> &str {
        self.any().map_or("", |bound| &bound.wanted)
    }

    /// Returns the attribute that states the demand.
    pub(crate) fn attribute(&self) -> &'static str {
        self.attribute
    }

    /// Returns the bound of this demand that excludes the other demand.
    pub(crate) fn against(&self, other: &Demand<'m, 'd>) -> Option<&Bound<'m, 'd>> {
        if let (Some((word, bound)), Some((wanted, _))) = (&self.word, &other.word) {
            return (word != wanted).then_some(bound);
        }
        let empty = |low: &Bound<'m, 'd>, high: &Bound<'m, 'd>| {
            low.value > high.value || (low.value == high.value && !(low.closed && high.closed))
        };
        match (&self.low, &other.high) {
            (Some(low), Some(high)) if empty(low, high) => return Some(low),
            _ => {}
        }
        match (&other.low, &self.high) {
            (Some(low), Some(high)) if empty(low, high) => Some(high),
            _ => None,
        }
    }

    /// Adds the stricter bounds of the other demand.
    pub(crate) fn narrow(&mut self, other: Demand<'m, 'd>) {
        let tighter_low = |one: &Bound<'m, 'd>, than: &Bound<'m, 'd>| {
            one.value > than.value || (one.value == than.value && than.closed)
        };
        let tighter_high = |one: &Bound<'m, 'd>, than: &Bound<'m, 'd>| {
            one.value < than.value || (one.value == than.value && than.closed)
        };
        if let Some(low) = other.low
            && self
                .low
                .as_ref()
                .is_none_or(|known| tighter_low(&low, known))
        {
            self.low = Some(low);
        }
        if let Some(high) = other.high
            && self
                .high
                .as_ref()
                .is_none_or(|known| tighter_high(&high, known))
        {
            self.high = Some(high);
        }
        self.word = self.word.take().or(other.word);
    }
}

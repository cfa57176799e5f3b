//! References by name: what names whom, and what to say when nobody bears the name.

use qcbus_openscenario::Element;
use qcbus_sdk::Sink;

use crate::model::About;

/// Attributes that name a scenario object or a selection.
pub(crate) const ENTITY_REFERENCES: &[(&str, &str)] = &[
    ("EntityRef", "entityRef"),
    ("Private", "entityRef"),
    ("EntityAction", "entityRef"),
    ("CentralObject", "entityRef"),
    ("FromCurrentEntity", "entityRef"),
    ("LateralDistanceAction", "entityRef"),
    ("LongitudinalDistanceAction", "entityRef"),
    ("RelativeAngleCondition", "entityRef"),
    ("RelativeDistanceCondition", "entityRef"),
    ("RelativeLanePosition", "entityRef"),
    ("RelativeObjectPosition", "entityRef"),
    ("RelativeRoadPosition", "entityRef"),
    ("RelativeSpeedCondition", "entityRef"),
    ("RelativeTargetLane", "entityRef"),
    ("RelativeTargetLaneOffset", "entityRef"),
    ("RelativeTargetSpeed", "entityRef"),
    ("RelativeWorldPosition", "entityRef"),
    ("SpeedProfileAction", "entityRef"),
    ("TimeHeadwayCondition", "entityRef"),
    ("TrailerRef", "entityRef"),
    ("ConnectTrailerAction", "trailerRef"),
    ("SynchronizeAction", "masterEntityRef"),
];

/// Findings of one rule that come with a hint.
const MOST_HINTS: u64 = 100;

/// Says that a reference leads nowhere: `what` is the kind of thing that it names, `names` are those
/// that there are.
pub(crate) fn unresolved<'n>(
    reference: Element<'_, '_>,
    attribute: &str,
    name: &str,
    what: &str,
    names: impl Iterator<Item = &'n str>,
    found: &mut Sink<'_>,
) {
    // A hint looks at all names; whoever has so many faults has another problem than a slip.
    let hint = if found.count() < MOST_HINTS {
        hint(name, names)
    } else {
        String::new()
    };
    let text = format!(
        "`{}` refers to the {what} {}, but there is none{hint}",
        reference.name(),
        quoted(reference, attribute, name)
    );
    found.about(reference, attribute, text);
}

/// The name in backticks; where a parameter or an expression led to it, what is written, too.
pub(crate) fn quoted(element: Element<'_, '_>, attribute: &str, value: &str) -> String {
    match element.written(attribute) {
        Some(written) if written != value => format!("`{value}` (`{written}`)"),
        _ => format!("`{value}`"),
    }
}

/// What may have been meant: a name that differs by white space, case or a letter or two.
pub(crate) fn hint<'n>(name: &str, names: impl Iterator<Item = &'n str>) -> String {
    let mut names = names.peekable();
    if names.peek().is_none() {
        return String::new();
    }
    let names: Vec<&str> = names.collect();
    let plain = |text: &str| text.split_whitespace().collect::<String>().to_lowercase();
    let spaced = names
        .iter()
        .find(|other| plain(other) == plain(name))
        .copied();
    match spaced.or_else(|| qcbus_openscenario::closest(name, names.iter().copied())) {
        Some(near) => format!("; `{near}` is there, names must be equal to the letter"),
        None => String::new(),
    }
}

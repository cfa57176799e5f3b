//! Common wording of messages about scenarios.

use crate::queries::element::Element;
use crate::timeline::{Impossible, Reason};

/// Formats a number with at most three decimals.
pub fn short(value: f64) -> String {
    let rounded = (value * 1000.0).round() / 1000.0;
    format!("{}", if rounded == 0.0 { 0.0 } else { rounded })
}

/// Formats an element with its name for messages: "the act `Drive`".
pub fn called(element: Element<'_, '_>) -> String {
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

/// Formats a number as it is written. If the text contains a parameter or an expression, the result
/// comes first and the text follows.
pub fn stated(element: Element<'_, '_>, attribute: &str, value: f64) -> String {
    match element.written(attribute) {
        Some(written) if written.contains('$') => format!("`{}` (`{written}`)", short(value)),
        Some(written) => format!("`{}`", written.trim()),
        None => format!("`{}`", short(value)),
    }
}

/// Describes why a condition is never true: "the condition requires `greaterThan` `70`, but the
/// `maxSpeed` of `Ego` is 60 m/s".
pub fn described(impossible: &Impossible<'_, '_>) -> String {
    let Impossible {
        element,
        attribute,
        reason,
    } = *impossible;
    let rule = element.word("rule").unwrap_or_default();
    let value = match element.number(attribute) {
        Some(value) => stated(element, attribute, value),
        None => format!("`{}`", element.written(attribute).unwrap_or_default()),
    };
    let but = match reason {
        Reason::BelowZero => format!("{} is never below 0", quantity(element.name())),
        Reason::Speed { entity, limit } => {
            format!("the `maxSpeed` of `{entity}` is {} m/s", short(limit))
        }
        Reason::Acceleration { entity, limit } => {
            format!(
                "`{entity}` accelerates and brakes with at most {} m/s²",
                short(limit)
            )
        }
        Reason::DayStandsStill => "the time of day stands still (`animation=\"false\"`)".to_owned(),
        Reason::DayIsLater => "the run begins later".to_owned(),
        Reason::DayNotSet => {
            "no action sets the time of day (`TimeOfDay` of an `Environment`)".to_owned()
        }
    };
    format!("the condition requires `{rule}` {value}, but {but}")
}

fn quantity(name: &str) -> &'static str {
    match name {
        "SimulationTimeCondition" => "the simulation time",
        "TimeHeadwayCondition" => "a time headway",
        "TimeToCollisionCondition" => "a time to collision",
        _ => "a distance",
    }
}

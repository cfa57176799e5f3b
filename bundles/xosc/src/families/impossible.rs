//! Conditions that the scenario itself makes impossible, for messages.

use crate::families::actions::{short, stated};
use qcbus_openscenario::{Impossible, ImpossibleReason};

/// Describes why a condition is never true: "the condition requires `greaterThan` `70`, but the
/// `maxSpeed` of `Ego` is 60 m/s".
pub(crate) fn described(impossible: &Impossible<'_, '_>) -> String {
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
        ImpossibleReason::BelowZero => format!("{} is never below 0", quantity(element.name())),
        ImpossibleReason::Speed { entity, limit } => {
            format!("the `maxSpeed` of `{entity}` is {} m/s", short(limit))
        }
        ImpossibleReason::Acceleration { entity, limit } => {
            format!(
                "`{entity}` accelerates and brakes with at most {} m/s²",
                short(limit)
            )
        }
        ImpossibleReason::DayStandsStill => {
            "the time of day stands still (`animation=\"false\"`)".to_owned()
        }
        ImpossibleReason::DayIsLater => "the run begins later".to_owned(),
        ImpossibleReason::DayNotSet => {
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

use std::f64::consts::TAU;

use crate::assembly::{Assembly, Modular};
use crate::families::copies::WrittenIn;
use crate::families::finds::Finds;
use crate::families::typings::Typings;
use crate::prelude::*;
use qcbus_openscenario::parse_double;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

/// Attributes of a type with their allowed numbers.
struct Range {
    class: &'static str,
    attributes: &'static [&'static str],
    low: f64,
    high: f64,
    /// Reason for the limits.
    why: &'static str,
}

const fn range(
    class: &'static str,
    attributes: &'static [&'static str],
    (low, high): (f64, f64),
    why: &'static str,
) -> Range {
    Range {
        class,
        attributes,
        low,
        high,
        why,
    }
}

const POSITIVE: (f64, f64) = (0.0, f64::INFINITY);
const COUNT: (f64, f64) = (1.0, f64::INFINITY);
const SHARE: (f64, f64) = (0.0, 1.0);
/// Two turns each way: rounded or summed up, an angle in radians may exceed one turn.
const ANGLE: (f64, f64) = (-2.0 * TAU, 2.0 * TAU);

const BACKWARDS: &str =
    "a negative speed means driving backwards, which not every simulator supports";
const DISTANCE: &str = "a distance cannot be negative";
const DURATION: &str = "a duration cannot be negative";
const MAGNITUDE: &str = "a limit cannot be negative";
const RADIANS: &str = "angles are in radians";
const SHARES: &str = "it is a fraction";

// The ranges follow the class descriptions of the standard. Only values that are commonly replaced
// in groups are listed. The bundle for OpenSCENARIO has all ranges.
#[rustfmt::skip]
const RANGES: &[Range] = &[
    range("AbsoluteSpeed", &["value"], POSITIVE, BACKWARDS),
    range("AbsoluteTargetSpeed", &["value"], POSITIVE, BACKWARDS),
    range("Condition", &["delay"], POSITIVE, "a delay cannot be negative"),
    range("DistanceCondition", &["value"], POSITIVE, DISTANCE),
    range("DynamicConstraints", &["maxAcceleration", "maxDeceleration", "maxSpeed"], POSITIVE, MAGNITUDE),
    range("EndOfRoadCondition", &["duration"], POSITIVE, DURATION),
    range("Event", &["maximumExecutionCount"], COUNT, "an event that never runs can be removed"),
    range("Fog", &["visualRange"], POSITIVE, DISTANCE),
    range("LateralDistanceAction", &["distance"], POSITIVE, DISTANCE),
    range("LongitudinalDistanceAction", &["distance", "timeGap"], POSITIVE, DISTANCE),
    range("OffroadCondition", &["duration"], POSITIVE, DURATION),
    range("Orientation", &["h", "p", "r"], ANGLE, RADIANS),
    range("OverrideBrakeAction", &["value"], SHARE, SHARES),
    range("OverrideClutchAction", &["value"], SHARE, SHARES),
    range("OverrideParkingBrakeAction", &["value"], SHARE, SHARES),
    range("OverrideThrottleAction", &["value"], SHARE, SHARES),
    range("Precipitation", &["intensity"], SHARE, SHARES),
    range("ReachPositionCondition", &["tolerance"], POSITIVE, DISTANCE),
    range("RelativeDistanceCondition", &["value"], POSITIVE, DISTANCE),
    range("RoadCondition", &["frictionScaleFactor"], POSITIVE, "friction cannot be negative"),
    range("SpeedProfileEntry", &["time"], POSITIVE, DURATION),
    range("StandStillCondition", &["duration"], POSITIVE, DURATION),
    range("TimeHeadwayCondition", &["value"], POSITIVE, DURATION),
    range("TimeToCollisionCondition", &["value"], POSITIVE, DURATION),
    range("TransitionDynamics", &["value"], POSITIVE, "a time, distance or rate cannot be negative here"),
    range("TraveledDistanceCondition", &["value"], POSITIVE, DISTANCE),
    range("WorldPosition", &["h", "p", "r"], ANGLE, RADIANS),
];

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let origins = WrittenIn::of(assembly);
    let mut typings = Typings::default();
    let mut finds = Finds::default();
    for taken in assembly.taken() {
        for (attribute, value) in taken.edited() {
            let Some(number) = parse_double(&value.text) else {
                continue;
            };
            let typing = typings.of(assembly, taken.copy.piece);
            let class = typing.and_then(|typing| typing.class(attribute.node()));
            let range = class.and_then(|class| range_of(class, attribute));
            let Some(range) = range.filter(|range| number < range.low || number > range.high)
            else {
                continue;
            };
            let Some(origin) = origins.get(value) else {
                continue;
            };
            let text = format!(
                "{} gives `{}` of `{}` the value `{}`, {}",
                origin.what(),
                attribute.name(),
                attribute.node().name(),
                value.text,
                range.instead(number)
            );
            finds.value(origin, attribute, text);
        }
    }
    finds.say(found);
}

fn range_of(class: &str, attribute: Attribute<'_>) -> Option<&'static Range> {
    let fits =
        |range: &&Range| range.class == class && range.attributes.contains(&attribute.name());
    RANGES.iter().find(fits)
}

impl Range {
    /// Describes the allowed values for a number that is out of range.
    fn instead(&self, number: f64) -> String {
        if (self.low, self.high) == ANGLE {
            let radians = (number.to_radians() * 1e4).round() / 1e4;
            return format!(
                "which is more than two turns: {}; if degrees are meant, write {radians}",
                self.why
            );
        }
        let allowed = match self.high == f64::INFINITY {
            true => format!("{} or more", self.low),
            false => format!("between {} and {}", self.low, self.high),
        };
        format!("but it should be {allowed}: {}", self.why)
    }
}

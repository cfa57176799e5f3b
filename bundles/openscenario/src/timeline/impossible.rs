//! Conditions that the scenario itself makes impossible.

use super::time_of_day::{self, TimeOfDay, comparison_in_seconds};
use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::entities::Entity;

/// A condition that is never true.
#[derive(Debug, Clone, Copy)]
pub struct Impossible<'m, 'd> {
    /// The element that compares, such as `SpeedCondition`.
    pub element: Element<'m, 'd>,
    /// The attribute with the value that is never reached.
    pub attribute: &'static str,
    /// The reason.
    pub reason: Reason<'m>,
}

/// Why a condition is never true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Reason<'m> {
    /// The quantity is never below 0.
    BelowZero,
    /// An entity is never so fast.
    Speed {
        /// Name of the entity.
        entity: &'m str,
        /// Its `maxSpeed` in m/s.
        limit: f64,
    },
    /// An entity never accelerates so strongly.
    Acceleration {
        /// Name of the entity.
        entity: &'m str,
        /// The larger of its `maxAcceleration` and `maxDeceleration` in m/s².
        limit: f64,
    },
    /// The time of day stands still before the time.
    DayStandsStill,
    /// The time of day is already later.
    DayIsLater,
    /// No action sets the time of day.
    DayNotSet,
}

impl Reason<'_> {
    /// Checks whether all simulators agree. Some do not enforce the limits of a vehicle, and some
    /// have no time of day.
    pub fn is_certain(&self) -> bool {
        matches!(self, Reason::BelowZero)
    }
}

/// Conditions about quantities that are never below zero.
const NEVER_NEGATIVE: &[&str] = &[
    "SimulationTimeCondition",
    "TimeHeadwayCondition",
    "TimeToCollisionCondition",
    "DistanceCondition",
    "RelativeDistanceCondition",
];

impl Scenario<'_> {
    /// Returns why a `Condition` is never true, as far as the scenario itself says so.
    pub fn impossible<'m, 'd>(&'m self, condition: Element<'m, 'd>) -> Option<Impossible<'m, 'd>> {
        if let Some(by_entity) = condition.child("ByEntityCondition") {
            let element = by_entity.child("EntityCondition")?.children().next()?;
            return below_zero(element).or_else(|| beyond_limits(by_entity, element));
        }
        let element = condition.child("ByValueCondition")?.children().next()?;
        below_zero(element).or_else(|| at_no_time_of_day(element))
    }
}

fn below_zero<'m, 'd>(element: Element<'m, 'd>) -> Option<Impossible<'m, 'd>> {
    if !NEVER_NEGATIVE.contains(&element.name()) {
        return None;
    }
    let value = element.number("value")?;
    let never = match &*element.word("rule")? {
        "lessThan" => value <= 0.0,
        "lessOrEqual" | "equalTo" => value < 0.0,
        _ => false,
    };
    never.then_some(Impossible {
        element,
        attribute: "value",
        reason: Reason::BelowZero,
    })
}

/// Returns the reason if the entities of a condition can never be so fast.
fn beyond_limits<'m, 'd>(
    by_entity: Element<'m, 'd>,
    element: Element<'m, 'd>,
) -> Option<Impossible<'m, 'd>> {
    let (of_limits, reason): (Limits, for<'n> fn(&'n str, f64) -> Reason<'n>) = match element.name()
    {
        "SpeedCondition" => (top_speed, |entity, limit| Reason::Speed { entity, limit }),
        "AccelerationCondition" => (strongest, |entity, limit| Reason::Acceleration {
            entity,
            limit,
        }),
        _ => return None,
    };
    let value = element.number("value")?;
    let rule = element.word("rule")?;
    let is_beyond = |limit: f64| match &*rule {
        "greaterThan" => value >= limit,
        "greaterOrEqual" | "equalTo" => value > limit,
        _ => false,
    };
    let triggering = by_entity.child("TriggeringEntities")?;
    let all = match &*triggering.word("triggeringEntitiesRule")? {
        "all" => true,
        "any" => false,
        _ => return None,
    };
    let scenario = element.scenario();
    let mut weakest: Option<(&'m str, f64)> = None;
    for reference in triggering.children_named("EntityRef") {
        for entity in scenario.entities().expand(&reference.text("entityRef")?)? {
            let found = of_limits(entity, element).filter(|limit| is_beyond(*limit));
            match (found, all) {
                (Some(limit), true) => return Some(beyond(element, reason(entity.name(), limit))),
                (Some(limit), false) if weakest.is_none_or(|(_, most)| most < limit) => {
                    weakest = Some((entity.name(), limit));
                }
                (Some(_), false) | (None, true) => {}
                (None, false) => return None,
            }
        }
    }
    let (entity, limit) = weakest?;
    Some(beyond(element, reason(entity, limit)))
}

fn beyond<'m, 'd>(element: Element<'m, 'd>, reason: Reason<'m>) -> Impossible<'m, 'd> {
    Impossible {
        element,
        attribute: "value",
        reason,
    }
}

/// A limit of an entity.
type Limits = for<'d> fn(&Entity<'d>, Element<'_, 'd>) -> Option<f64>;

fn top_speed<'d>(entity: &Entity<'d>, condition: Element<'_, 'd>) -> Option<f64> {
    let limit = performance(entity, condition, "maxSpeed")?;
    // A scenario that asks for more may count on a simulator that ignores the limit.
    let targets = condition.scenario();
    let mut targets = targets.elements_everywhere("AbsoluteTargetSpeed");
    let asks_for_more = targets.any(|it| it.number("value").is_none_or(|value| value > limit));
    (!asks_for_more).then_some(limit)
}

fn strongest<'d>(entity: &Entity<'d>, condition: Element<'_, 'd>) -> Option<f64> {
    let forward = performance(entity, condition, "maxAcceleration")?;
    let back = performance(entity, condition, "maxDeceleration")?;
    Some(forward.max(back))
}

fn performance<'d>(entity: &Entity<'d>, condition: Element<'_, 'd>, name: &str) -> Option<f64> {
    let object = entity.object(condition.scenario())?;
    let limit = object.child("Performance")?.number(name)?;
    Some(limit).filter(|limit| *limit >= 0.0)
}

fn at_no_time_of_day<'m, 'd>(element: Element<'m, 'd>) -> Option<Impossible<'m, 'd>> {
    if !element.is("TimeOfDayCondition") {
        return None;
    }
    if time_of_day::is_unset(element.scenario()) {
        return Some(Impossible {
            element,
            attribute: "dateTime",
            reason: Reason::DayNotSet,
        });
    }
    let (rule, seconds) = comparison_in_seconds(element)?;
    let passes = TimeOfDay::of(element.scenario())?.passes;
    let never = match (&*rule, passes) {
        ("lessThan", _) => seconds <= 0.0,
        ("lessOrEqual", _) | ("equalTo", true) => seconds < 0.0,
        ("equalTo", false) => seconds != 0.0,
        ("greaterThan", false) => seconds >= 0.0,
        ("greaterOrEqual", false) => seconds > 0.0,
        ("notEqualTo", false) => seconds == 0.0,
        _ => false,
    };
    let is_over = seconds <= 0.0 && matches!(&*rule, "lessThan" | "lessOrEqual" | "equalTo");
    let reason = match is_over {
        true => Reason::DayIsLater,
        false => Reason::DayStandsStill,
    };
    never.then_some(Impossible {
        element,
        attribute: "dateTime",
        reason,
    })
}

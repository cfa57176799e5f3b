//! Conditions in short form: "simulation time > 3 s".

use crate::queries::element::Element;
use crate::wording::short;

/// Maximum number of conditions of a trigger that are described.
const MOST: usize = 4;

/// Describes the conditions of a trigger. The text follows "waits until".
pub(super) fn trigger(trigger: Element<'_, '_>) -> String {
    let mut left = MOST;
    let mut more = 0_usize;
    let mut groups = Vec::new();
    for group in trigger.children_named("ConditionGroup") {
        let mut all = Vec::new();
        for one in group.children_named("Condition") {
            match left.checked_sub(1) {
                Some(rest) => {
                    left = rest;
                    all.push(condition(one));
                }
                None => more += 1,
            }
        }
        if !all.is_empty() {
            groups.push(all.join(" and "));
        }
    }
    let text = groups.join(", or ");
    match (text.is_empty(), more) {
        (true, _) => "its trigger, which has no conditions, is true".to_owned(),
        (false, 0) => text,
        (false, 1) => format!("{text}, and 1 more condition"),
        (false, more) => format!("{text}, and {more} more conditions"),
    }
}

/// Describes a `Condition` with its edge and delay.
pub(super) fn condition(condition: Element<'_, '_>) -> String {
    let mut text = expression(condition).unwrap_or_else(|| "an unknown condition".to_owned());
    match condition.word("conditionEdge").as_deref() {
        Some("falling") => text.push_str(" (falling edge)"),
        Some("risingOrFalling") => text.push_str(" (rising or falling edge)"),
        _ => {}
    }
    match condition.number("delay").filter(|delay| *delay > 0.0) {
        Some(delay) => format!("{text} (delay {} s)", short(delay)),
        None => text,
    }
}

fn expression(condition: Element<'_, '_>) -> Option<String> {
    if let Some(by_value) = condition.child("ByValueCondition") {
        let kind = by_value.children().next()?;
        // CARLA's criteria compare a parameter with an empty name. Only their own names differ.
        let is_criterion = kind
            .text("parameterRef")
            .is_some_and(|name| name.is_empty());
        return Some(match condition.text("name").filter(|_| is_criterion) {
            Some(name) => format!("the condition `{name}` is true"),
            None => value(kind),
        });
    }
    let by_entity = condition.child("ByEntityCondition")?;
    let kind = by_entity.child("EntityCondition")?.children().next()?;
    let triggering = by_entity.child("TriggeringEntities")?;
    let names = triggering.children_named("EntityRef");
    let names: Vec<String> = names
        .filter_map(|it| Some(format!("`{}`", it.text("entityRef")?)))
        .collect();
    let join = match triggering.word("triggeringEntitiesRule").as_deref() {
        Some("all") => " and ",
        _ => " or ",
    };
    Some(entity(kind, &names.join(join)))
}

fn value(kind: Element<'_, '_>) -> String {
    let text = |name: &str| kind.text(name).unwrap_or_default();
    match kind.name() {
        "SimulationTimeCondition" => format!("simulation time {}", compared(kind, "value", " s")),
        "TimeOfDayCondition" => format!("time of day {}", compared(kind, "dateTime", "")),
        "StoryboardElementStateCondition" => format!(
            "`{}` of the {} `{}`",
            text("state"),
            text("storyboardElementType"),
            text("storyboardElementRef")
        ),
        "ParameterCondition" => {
            let name = text("parameterRef");
            format!("parameter `{name}` {}", compared(kind, "value", ""))
        }
        "VariableCondition" => {
            let name = text("variableRef");
            format!("variable `{name}` {}", compared(kind, "value", ""))
        }
        "UserDefinedValueCondition" => {
            format!("`{}` {}", text("name"), compared(kind, "value", ""))
        }
        "TrafficSignalCondition" => {
            format!("signal `{}` shows `{}`", text("name"), text("state"))
        }
        "TrafficSignalControllerCondition" => format!(
            "traffic signal controller `{}` is in phase `{}`",
            text("trafficSignalControllerRef"),
            text("phase")
        ),
        other => format!("`{other}` is true"),
    }
}

fn entity(kind: Element<'_, '_>, who: &str) -> String {
    let other = kind.text("entityRef").unwrap_or_default();
    let lasts = || match kind.number("duration") {
        Some(seconds) => format!(" for {} s", short(seconds)),
        None => String::new(),
    };
    match kind.name() {
        "SpeedCondition" => format!("speed of {who} {}", compared(kind, "value", " m/s")),
        "AccelerationCondition" => {
            format!("acceleration of {who} {}", compared(kind, "value", " m/s²"))
        }
        "RelativeSpeedCondition" => format!(
            "speed of {who} relative to `{other}` {}",
            compared(kind, "value", " m/s")
        ),
        "TimeHeadwayCondition" => format!(
            "time headway of {who} to `{other}` {}",
            compared(kind, "value", " s")
        ),
        "TimeToCollisionCondition" => format!(
            "time to collision of {who} {}",
            compared(kind, "value", " s")
        ),
        "RelativeDistanceCondition" => format!(
            "distance of {who} to `{other}` {}",
            compared(kind, "value", " m")
        ),
        "DistanceCondition" => format!(
            "distance of {who} to a position {}",
            compared(kind, "value", " m")
        ),
        "TraveledDistanceCondition" => match kind.number("value") {
            Some(value) => format!("{who} has traveled {} m", short(value)),
            None => format!("{who} has traveled an unknown distance"),
        },
        "ReachPositionCondition" => format!("{who} reaches a position"),
        "StandStillCondition" => format!("{who} stands still{}", lasts()),
        "EndOfRoadCondition" => format!("{who} is at the end of the road{}", lasts()),
        "OffroadCondition" => format!("{who} is off the road{}", lasts()),
        "CollisionCondition" => format!("{who} collides"),
        name => format!("`{name}` of {who} is true"),
    }
}

/// Formats a comparison: "> 3 s". Without a rule, the standard compares for equality.
fn compared(kind: Element<'_, '_>, attribute: &str, unit: &str) -> String {
    let sign = match kind.word("rule").as_deref() {
        Some("greaterThan") => ">",
        Some("greaterOrEqual") => "≥",
        Some("lessThan") => "<",
        Some("lessOrEqual") => "≤",
        Some("notEqualTo") => "≠",
        _ => "=",
    };
    let value = match (kind.number(attribute), kind.text(attribute)) {
        (Some(number), _) => short(number),
        (None, Some(text)) => format!("`{text}`"),
        (None, None) => "an unknown value".to_owned(),
    };
    format!("{sign} {value}{unit}")
}

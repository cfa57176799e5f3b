use crate::families::actions::{acting, stated};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for dynamics in scenario.elements_everywhere("LaneOffsetActionDynamics") {
        let shape = dynamics.word("dynamicsShape");
        // An entity without offset need not move.
        let target = dynamics
            .parent()
            .and_then(|action| action.path(&["LaneOffsetTarget", "AbsoluteTargetLaneOffset"]));
        let is_there = target.is_some_and(|target| target.number("value") == Some(0.0));
        let is_gradual = shape.is_some_and(|shape| shape != "step");
        if is_zero(dynamics, "maxLateralAcc") && is_gradual && !is_there {
            let so = "the entity never moves sideways, and the offset is never reached";
            report(dynamics, "maxLateralAcc", so, found);
        }
    }
    for limits in scenario.elements_everywhere("DynamicConstraints") {
        constraints(limits, found);
    }
    for action in scenario.elements_everywhere("SpeedAction") {
        vehicle(action, found);
    }
}

/// The limits by which speeds rise, and those by which they fall.
const UP: [&str; 2] = ["maxAcceleration", "maxAccelerationRate"];
const DOWN: [&str; 2] = ["maxDeceleration", "maxDecelerationRate"];

fn constraints(limits: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(action) = limits.parent() else {
        return;
    };
    let zero = |names: &[&'static str]| names.iter().copied().find(|name| is_zero(limits, name));
    let (up, down) = (zero(&UP), zero(&DOWN));
    let steady = steady_speed(action);
    if is_zero(limits, "maxSpeed") {
        // An entity that stands already may stay so.
        if steady != Some(0.0) {
            let so = "the entity must stand still, and the action never reaches its goal";
            report(limits, "maxSpeed", so, found);
        }
    } else if let (Some(up), Some(_), None) = (up, down, steady) {
        let so = "the limit for braking is 0, too; the speed never changes, and the action never reaches its goal";
        report(limits, up, so, found);
    } else if let Some(name) = up.or(down) {
        let missing = if up.is_some() { "accelerate" } else { "brake" };
        match action.name() {
            "LateralDistanceAction" => {
                let so = "a motion sideways must begin and end, so the distance is never reached";
                report(limits, name, so, found);
            }
            "SpeedProfileAction" if needs(action, up.is_some()) => {
                let so = format!(
                    "the entity cannot {missing}, but the next speed of the profile needs it"
                );
                report(limits, name, &so, found);
            }
            "LongitudinalDistanceAction" => {
                let so = format!(
                    "the entity cannot {missing}, so the distance is reached only if that is not needed"
                );
                let text = text(limits, name, &so);
                found.about(limits, name, text).level(Level::Information);
            }
            _ => {}
        }
    }
}

/// Returns the speed of a profile that has only one. The entity may have it already.
fn steady_speed(action: Element<'_, '_>) -> Option<f64> {
    let mut entries = action.children_named("SpeedProfileEntry");
    let speed = entries.next()?.number("speed")?;
    let mut others = entries.map(|entry| entry.number("speed"));
    others.all(|other| other == Some(speed)).then_some(speed)
}

/// Reports a transition of the speed of a vehicle that can neither accelerate nor brake.
fn vehicle(action: Element<'_, '_>, found: &mut Sink<'_>) {
    let Some(dynamics) = action.child("SpeedActionDynamics") else {
        return;
    };
    let shape = dynamics.word("dynamicsShape");
    if shape.is_none_or(|shape| shape == "step") {
        return;
    }
    for entity in acting(action).unwrap_or_default() {
        let object = entity.object(action.scenario());
        let Some(performance) = object.and_then(|object| object.child("Performance")) else {
            continue;
        };
        if !(is_zero(performance, "maxAcceleration") && is_zero(performance, "maxDeceleration")) {
            continue;
        }
        let follows = dynamics.word("followingMode").as_deref() == Some("follow");
        let (level, so) = match follows {
            true => (Level::Warning, "so it never reaches the speed"),
            false => (
                Level::Information,
                "so a simulator either exceeds its limits or never reaches the speed",
            ),
        };
        let text = format!(
            "`maxAcceleration` and `maxDeceleration` of `{}` are 0, {so}; correct its `Performance`",
            entity.name()
        );
        found
            .about(dynamics, "", text)
            .at(performance.node(), "the limits of the vehicle")
            .level(level);
        return;
    }
}

/// Checks whether a speed of a profile is above the one before it, or below it.
fn needs(profile: Element<'_, '_>, above: bool) -> bool {
    let entries = profile.children_named("SpeedProfileEntry");
    let speeds: Option<Vec<f64>> = entries.map(|entry| entry.number("speed")).collect();
    let speeds = speeds.unwrap_or_default();
    speeds.windows(2).any(|pair| match pair {
        [one, next] if above => next > one,
        [one, next] => next < one,
        _ => false,
    })
}

fn is_zero(element: Element<'_, '_>, name: &str) -> bool {
    element.number(name) == Some(0.0)
}

fn text(element: Element<'_, '_>, name: &str, so: &str) -> String {
    let value = stated(element, name, 0.0);
    format!("`{name}` is {value}: {so}; use a value greater than 0, or leave it out for no limit")
}

fn report(element: Element<'_, '_>, name: &str, so: &str, found: &mut Sink<'_>) {
    let text = text(element, name, so);
    found.about(element, name, text);
}

use std::cell::LazyCell;

use crate::families::actions::acting;
use crate::families::motion::{Speeds, may_drive_itself};
use crate::families::trajectories::{TimedPoint, followed, named, shape, timed_points};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    params: &[SLOW],
    run,
    ..Rule::after(READABLE)
};

const SLOW: Param = Param::number(
    "slow",
    0.1,
    "m/s",
    "an entity that is never faster than this seems to stand",
);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let slow = found.number(&SLOW);
    let speeds = LazyCell::new(|| Speeds::of(scenario));
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        let Some(none) = action.path(&["TimeReference", "None"]) else {
            continue;
        };
        let Some(trajectory) = followed(action) else {
            continue;
        };
        let stamps = shape(trajectory).map(timed_points).unwrap_or_default();
        let rising = rising(&stamps);
        let stands = speeds.as_ref().and_then(|it| standing(action, it, slow));
        match (stands, rising) {
            (Some((entity, speed)), _) => {
                let why = match speed {
                    Some(speed) => format!("its speed is at most {speed} m/s"),
                    None => "no action gives it a speed".to_owned(),
                };
                let way_out = match rising {
                    Some(_) => {
                        "the times of the trajectory are ignored; use `Timing` instead of `None`"
                    }
                    None => "give it a speed, or give the trajectory times and use `Timing`",
                };
                let text = format!(
                    "`{entity}` follows the {} without `Timing`, but {why}, so it stands; {way_out}",
                    named(trajectory)
                );
                let place = if rising.is_some() { none } else { action };
                found.about(place, "", text).level(Level::Warning);
            }
            // A catalog's trajectory may be followed elsewhere with its times.
            (None, Some(first)) if trajectory.reference() == action.reference() => {
                let text = format!(
                    "the times of the {} are ignored, because its `TimeReference` is `None`; the entity keeps its \
                     own speed; use `Timing`, or remove the times",
                    named(trajectory)
                );
                found
                    .about(first.element, first.attribute, text)
                    .at(none.node(), "the element that ignores the times");
            }
            (None, _) => {}
        }
    }
}

/// Returns the first point of a trajectory if all points have times, and these rise. Version 1.0
/// requires a time at each vertex, and many files write the same one everywhere.
fn rising<'m, 'd>(stamps: &[TimedPoint<'m, 'd>]) -> Option<TimedPoint<'m, 'd>> {
    let first = *stamps.first()?;
    let is_old = first.element.is("Vertex") && first.element.scenario().version() < (1, 1);
    let times: Option<Vec<f64>> = stamps.iter().map(|stamp| stamp.time()).collect();
    let times = times?;
    let is_rising = times.len() > 1 && times.windows(2).all(|pair| pair.first() < pair.last());
    (is_rising && !is_old).then_some(first)
}

/// Returns the first actor that never moves or is slow, with its speed if actions give it one.
fn standing(action: Element<'_, '_>, speeds: &Speeds, slow: f64) -> Option<(String, Option<f64>)> {
    let scenario = action.scenario();
    let actors = acting(action)?;
    let mut still = actors.into_iter().filter(|entity| {
        let speed = speeds.fastest(entity.name());
        speed.is_none_or(|speed| speed <= slow) && !may_drive_itself(scenario, entity)
    });
    let entity = still.next()?;
    Some((entity.name().to_owned(), speeds.fastest(entity.name())))
}

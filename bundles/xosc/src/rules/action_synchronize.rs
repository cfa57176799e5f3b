use crate::families::actions::{acting, short};
use crate::families::behind::Behind;
use crate::families::motion::{Speeds, may_drive_itself};
use crate::families::placement;
use crate::families::positions::Spot;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut actions = scenario.elements_everywhere("SynchronizeAction").peekable();
    if actions.peek().is_none() {
        return;
    }
    let speeds = Speeds::of(scenario);
    for action in actions {
        let Some(master) = action.text("masterEntityRef") else {
            continue;
        };
        let acting = acting(action).unwrap_or_default();
        if acting.iter().any(|entity| entity.name() == master) {
            let text = format!(
                "{} is the master and an actor of this action; an entity cannot arrive together with itself, so \
                 the master must be another entity",
                quoted(action, "masterEntityRef", &master)
            );
            found.about(action, "masterEntityRef", text);
        } else if let Some(speeds) = &speeds {
            standing(action, &master, speeds, found);
        }
    }
    if let (Network::Map(network), Some(speeds)) = (scenario.network(), &speeds) {
        network.with(|map| targets(scenario, map, speeds, found));
    }
}

/// Reports targets that lie behind their entity when the action starts.
fn targets(scenario: &Scenario<'_>, map: &RoadMap<'_>, speeds: &Speeds, found: &mut Sink<'_>) {
    let Some(behind) = Behind::of(scenario, map, speeds) else {
        return;
    };
    let timeline = scenario.timeline();
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let action = one.element(scenario);
        let Some(action) = action.path(&["PrivateAction", "SynchronizeAction"]) else {
            continue;
        };
        let start = timeline.and_then(|timeline| timeline.tolerant().get(place)?.start.into());
        let Some(start) = start.filter(|start| !start.is_never()) else {
            continue;
        };
        let master = action
            .text("masterEntityRef")
            .map(std::borrow::Cow::into_owned);
        let actors = acting(action).unwrap_or_default();
        let actors = actors
            .iter()
            .map(|actor| (actor.name().to_owned(), "TargetPosition"));
        let master = master.map(|master| (master, "TargetPositionMaster"));
        for (entity, target) in master.into_iter().chain(actors) {
            let position = action.child(target).and_then(|it| it.children().next());
            let Some((position, by)) =
                position.and_then(|it| Some((it, behind.by(&entity, it, start.earliest)?)))
            else {
                continue;
            };
            let text = format!(
                "`{target}` is {} m behind `{entity}` or more when the action starts, and no way leads back to it; the \
                 entities cannot arrive together; move the target, or start the action earlier",
                short(by)
            );
            found.about(position, "s", text);
        }
    }
}

/// Reports a master that never arrives, because it stands or is too slow.
fn standing(action: Element<'_, '_>, master: &str, speeds: &Speeds, found: &mut Sink<'_>) {
    let scenario = action.scenario();
    let Some(entity) = scenario.entities().object(master) else {
        return;
    };
    let speed = speeds.fastest(master);
    if may_drive_itself(scenario, entity) {
        return;
    }
    let Some(away) = distance(action, master) else {
        return;
    };
    if let Some(speed) = speed.filter(|speed| *speed > 0.0) {
        late(action, master, away / speed, found);
        return;
    }
    let (why, level) = match speed {
        Some(_) => ("its speed is 0 from the start", Level::Warning),
        None => (
            "no action gives it a speed, unless the simulator drives it",
            Level::Information,
        ),
    };
    let text = format!(
        "the master {} never arrives at `TargetPositionMaster`, {} m away, because {why}; the actors wait for it; give \
         it a speed, or choose another master",
        quoted(action, "masterEntityRef", master),
        short(away)
    );
    found.about(action, "masterEntityRef", text).level(level);
}

/// Reports a master that needs more seconds to its target than the run lasts.
fn late(action: Element<'_, '_>, master: &str, seconds: f64, found: &mut Sink<'_>) {
    let Some(timeline) = action.scenario().timeline() else {
        return;
    };
    let end = timeline.tolerant().ends.latest;
    if end.is_finite() && seconds > end {
        let text = format!(
            "the master {} arrives at `TargetPositionMaster` after {} s at the earliest, by its greatest speed, but the \
             run ends at {} s; the actors never arrive together with it",
            quoted(action, "masterEntityRef", master),
            short(seconds),
            short(timeline.standard.ends.earliest)
        );
        found
            .about(action, "masterEntityRef", text)
            .level(Level::Information);
    }
}

/// Returns the distance between the place of the master in `Init` and its target, if it is greater
/// than the tolerance.
fn distance(action: Element<'_, '_>, master: &str) -> Option<f64> {
    let starts = placement::starts(action.scenario());
    let mut starts = starts.iter().filter(|start| start.name == master);
    let (start, None) = (starts.next()?, starts.next()) else {
        return None;
    };
    let here = Spot::of(start.position.parent()?)?;
    let away = Spot::of(action.child("TargetPositionMaster")?)?.distance(&here)?;
    let tolerance = action.number("targetToleranceMaster").unwrap_or(0.0);
    (away > tolerance.max(1.0)).then_some(away)
}

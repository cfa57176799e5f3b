use crate::families::actions::short;
use crate::families::trajectories::{followed, named, shape, timed_points};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

/// Times that are past by less than this are rounding, or a step of the simulation.
const SLACK: f64 = 0.1;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut actions = scenario.elements_everywhere("FollowTrajectoryAction");
    if actions.next().is_none() {
        return;
    }
    let init = scenario.root().path(&["Storyboard", "Init"]);
    let in_init = init
        .into_iter()
        .flat_map(|init| init.descendants_named("FollowTrajectoryAction"));
    for follow in in_init {
        check(follow, 0.0, found);
    }
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for (place, one) in scenario.storyboard().elements().iter().enumerate() {
        let action = one.element(scenario);
        let follow = action.path(&["PrivateAction", "RoutingAction", "FollowTrajectoryAction"]);
        let start = timeline.tolerant().get(place).map(|span| span.start);
        let (Some(follow), Some(start)) = (follow, start) else {
            continue;
        };
        if !start.is_never() {
            check(follow, start.earliest, found);
        }
    }
}

/// Reports times before the earliest moment, in seconds of simulation time, at which the entity
/// begins to follow the trajectory.
fn check(follow: Element<'_, '_>, earliest: f64, found: &mut Sink<'_>) {
    let Some(timing) = follow.path(&["TimeReference", "Timing"]) else {
        return;
    };
    let domain = timing.word("domainAbsoluteRelative");
    let (begin, what) = match domain.as_deref() {
        Some("absolute") => (earliest, "simulation time"),
        Some("relative") => (0.0, "time since its start"),
        _ => return,
    };
    let (Some(scale), Some(offset)) = (timing.number("scale"), timing.number("offset")) else {
        return;
    };
    let Some(trajectory) = followed(follow) else {
        return;
    };
    let stamps = shape(trajectory).map(timed_points).unwrap_or_default();
    // A range rule reports negative times.
    let times: Option<Vec<f64>> = stamps
        .iter()
        .map(|stamp| Some(stamp.time().filter(|time| *time >= 0.0)? * scale + offset))
        .collect();
    let times = times.unwrap_or_default();
    let (Some(first), Some(last)) = (times.first(), times.last()) else {
        return;
    };
    // Other rules report times that do not rise.
    if times.len() < 2 || scale <= 0.0 || *last < *first || *first > begin - SLACK {
        return;
    }
    let (part, level) = match *last < begin - SLACK {
        true => (
            "all of it is past, so the entity jumps to its end",
            Level::Warning,
        ),
        false => (
            "its first part is past, so the entity jumps",
            Level::Information,
        ),
    };
    let text = format!(
        "the times of the {} run from {} s to {} s ({what}), but the action starts at {} s at the earliest; {part}; \
         use relative times, or an `offset`",
        named(trajectory),
        short(*first),
        short(*last),
        short(begin)
    );
    found.about(timing, "", text).level(level);
}

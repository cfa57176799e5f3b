use crate::families::positions::{metres, shown};
use crate::families::trajectories::{followed, longest, named};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        look_at(action, "initialDistanceOffset", found);
    }
    for position in scenario.elements_everywhere("TrajectoryPosition") {
        look_at(position, "s", found);
    }
}

fn look_at(element: Element<'_, '_>, attribute: &str, found: &mut Sink<'_>) {
    let Some(offset) = element.number(attribute) else {
        return;
    };
    let value = shown(element, attribute, &metres(offset));
    if offset < 0.0 {
        let text = format!(
            "`{attribute}` of `{}` is {value}, but must not be negative; a trajectory starts at 0",
            element.name()
        );
        found.about(element, attribute, text);
        return;
    }
    let Some(trajectory) = followed(element).filter(|_| offset > 0.0) else {
        return;
    };
    let Some(length) = longest(trajectory) else {
        return;
    };
    // An entity may stand at the end, but cannot continue from there.
    let (is_beyond, lost) = if element.is("TrajectoryPosition") {
        (offset > length + 1e-3, "it ends before that")
    } else {
        (offset >= length, "no part of it is left to follow")
    };
    if is_beyond {
        let text = format!(
            "`{attribute}` of `{}` is {value}, but the {} is at most {} long; {lost}",
            element.name(),
            named(trajectory),
            metres(length)
        );
        found
            .about(element, attribute, text)
            .at(trajectory.node(), "the trajectory");
    }
}

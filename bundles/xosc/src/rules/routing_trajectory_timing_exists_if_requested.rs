use crate::families::trajectories::{Timing, followed, named, shape, timed_points, timing_of};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        let Some(trajectory) = followed(action) else {
            continue;
        };
        let Timing::Asked(timing) = timing_of(trajectory) else {
            continue;
        };
        let Some(shape) = shape(trajectory) else {
            continue;
        };
        // In 1.0 the schema requires a time for vertices.
        if shape.is("Polyline") && scenario.version() < (1, 1) {
            continue;
        }
        let stamps = timed_points(shape);
        let missing = || {
            stamps
                .iter()
                .filter(|stamp| !stamp.element.has(stamp.attribute))
        };
        let Some(first) = missing().next() else {
            continue;
        };
        let (count, all) = (missing().count(), stamps.len());
        let text = format!(
            "`Timing` requires the times of the {}, but `{}` has no `{}`{}",
            named(trajectory),
            first.element.name(),
            first.attribute,
            if count > 1 {
                format!("; {count} of {all} times are missing")
            } else {
                String::new()
            }
        );
        found
            .about(first.element, "", text)
            .at(timing.node(), "the element that requires the times");
    }
}

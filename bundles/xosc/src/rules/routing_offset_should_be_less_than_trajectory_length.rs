use qcbus_openscenario::Scenario;
use qcbus_sdk::{Level, Rule, Sink};

use crate::families::positions::metres;
use crate::families::positions::shown;
use crate::families::trajectories::{followed, longest, named};
use crate::model::{About as _, Scene};

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_routing_offset_should_be_less_than_trajectory_length",
    uids: &["asam.net:xosc:1.1.0:routing.offset_should_be_less_than_trajectory_length"],
    level: Level::Warning,
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("routing_offset_should_be_less_than_trajectory_length.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("FollowTrajectoryAction") {
        let Some(offset) = action.number("initialDistanceOffset") else {
            continue;
        };
        let offset_text = shown(action, "initialDistanceOffset", &metres(offset));
        if offset < 0.0 {
            let text = format!(
                "`initialDistanceOffset` is {offset_text}; a trajectory begins at 0, there is nothing before it"
            );
            found.about(action, "initialDistanceOffset", text);
            continue;
        }
        let Some(trajectory) = followed(action).filter(|_| offset > 0.0) else {
            continue;
        };
        let Some(length) = longest(trajectory).filter(|length| offset >= *length) else {
            continue;
        };
        let text = format!(
            "`initialDistanceOffset` is {offset_text}, but the {} is no longer than {}: nothing of it is left to follow",
            named(trajectory),
            metres(length)
        );
        found
            .about(action, "initialDistanceOffset", text)
            .at(trajectory.node(), "the trajectory");
    }
}

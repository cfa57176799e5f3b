use crate::families::actions::{short, stated};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    params: &[MOST],
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

const MOST: Param = Param::number("most", 5.0, "m", "largest lane offset that is accepted");

/// Elements with an offset from the middle of a lane.
const OFFSETS: &[(&str, &str)] = &[
    ("AbsoluteTargetLaneOffset", "value"),
    ("RelativeTargetLaneOffset", "value"),
    ("LaneChangeAction", "targetLaneOffset"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let most = found.number(&MOST);
    for (name, attribute) in OFFSETS {
        for element in scenario.elements_everywhere(name) {
            let offset = element.number(attribute);
            let Some(offset) = offset.filter(|offset| offset.abs() > most) else {
                continue;
            };
            let text = format!(
                "the lane offset is {} m, which is more than {} m and leads out of most lanes; it is measured \
                 from the center of the lane, not of the road",
                stated(element, attribute, offset),
                short(most)
            );
            found.about(element, attribute, text);
        }
    }
}

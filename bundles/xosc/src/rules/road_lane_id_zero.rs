use crate::families::positions::lane_id;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for name in ["LanePosition", "FromLaneCoordinates"] {
        for position in scenario.elements_everywhere(name) {
            let Some(id) = position.text("laneId").filter(|id| lane_id(id) == Some(0)) else {
                continue;
            };
            let text = format!(
                "`{name}` refers to the lane {}, the center lane, which has no width; it is the line between the \
                 two sides of a road; lanes on the right have ids below zero, lanes on the left above zero",
                quoted(position, "laneId", &id)
            );
            found.about(position, "laneId", text);
        }
    }
    for target in scenario.elements_everywhere("AbsoluteTargetLane") {
        let Some(id) = target.text("value").filter(|id| lane_id(id) == Some(0)) else {
            continue;
        };
        let text = format!(
            "`AbsoluteTargetLane` refers to the lane {}, the center lane, which has no width; the vehicle would \
             drive on the line between the two sides of the road; if this is intended, use an offset",
            quoted(target, "value", &id)
        );
        found.about(target, "value", text);
    }
}

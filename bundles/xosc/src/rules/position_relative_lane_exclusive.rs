use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_position_relative_lane_exclusive",
    uids: &["qcbus.dev:xosc:1.0.0:position.relative_lane_exclusive"],
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("position_relative_lane_exclusive.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for position in scenario.elements_everywhere("RelativeLanePosition") {
        match (position.has("ds"), position.has("dsLane")) {
            (true, true) => {
                let text = "`RelativeLanePosition` has both `ds` and `dsLane`, but only one of them is allowed; \
                            `ds` is measured along the road's reference line, `dsLane` along the center of the \
                            lane";
                found.about(position, "dsLane", text);
            }
            (false, false) => {
                let text = "`RelativeLanePosition` has neither `ds` nor `dsLane`, so its position along the road \
                            is undefined; one of them is required";
                found.about(position, "", text);
            }
            _ => {}
        }
    }
}

use qcbus_openscenario::Scenario;
use qcbus_sdk::{Rule, Sink};

use crate::model::{About as _, Scene};

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
                let text = "`RelativeLanePosition` has both `ds` and `dsLane`; it is one of them: `ds` counts \
                            along the road's reference line, `dsLane` along the center of the lane";
                found.about(position, "dsLane", text);
            }
            (false, false) => {
                let text = "`RelativeLanePosition` has neither `ds` nor `dsLane`, so it does not say how far \
                            along the road it is; one of them is needed";
                found.about(position, "", text);
            }
            _ => {}
        }
    }
}

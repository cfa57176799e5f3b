use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
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

use crate::families::demands::contradict;
use crate::families::timeline::{self, differs};
use crate::prelude::*;
use qcbus_openscenario::Cause;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for never in timeline::never_started(scenario, timeline) {
        for cause in &never.causes {
            let Cause::Apart { one, other } = *cause else {
                continue;
            };
            let (Some(one), Some(other)) = (never.condition(one), never.condition(other)) else {
                continue;
            };
            // Another rule reports it with the values.
            if contradict(one, other) {
                continue;
            }
            let text = format!(
                "the two conditions become true at different moments, but all conditions of a group \
                 must be true at once; {}{}",
                never.so,
                differs(&never)
            );
            found
                .about(one, "", text)
                .at(other.node(), "the other condition");
        }
    }
}

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
    timeline::each_cause(scenario, |_, never, cause| {
        let Cause::Apart { one, other } = cause else {
            return;
        };
        let (Some(one), Some(other)) = (never.condition(one), never.condition(other)) else {
            return;
        };
        // Another rule reports it with the values.
        if contradict(one, other) {
            return;
        }
        let text = format!(
            "the two conditions become true at different moments, but all conditions of a group \
                 must be true at once; {}{}",
            never.so,
            differs(never)
        );
        found
            .about(one, "", text)
            .at(other.node(), "the other condition")
            .maybe_fault(timeline::start_of(one));
    });
}

use crate::families::timeline::{self, differs, follows};
use crate::prelude::*;
use qcbus_openscenario::Cause;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    timeline::each_cause(scenario, |timeline, never, cause| {
        let Cause::StateNeverComes { at, of } = cause else {
            return;
        };
        let Some(condition) = never.condition(at) else {
            return;
        };
        let state = condition.path(&["ByValueCondition", "StoryboardElementStateCondition"]);
        let Some(state) = state.filter(|it| !follows(timeline, *it, of, never.place)) else {
            return;
        };
        let text = format!(
            "{}; {}{}",
            timeline::state_never_comes(scenario, timeline, state, of),
            never.so,
            differs(never)
        );
        found
            .about(state, "state", text)
            .at(condition.node(), "the condition")
            .maybe_fault(timeline::start_of(state))
            .maybe_follows(timeline::start_within(scenario, timeline, of));
    });
}

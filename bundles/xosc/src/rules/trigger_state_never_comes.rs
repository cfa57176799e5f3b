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
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    for never in timeline::never_started(scenario, timeline) {
        for cause in &never.causes {
            let Cause::StateNeverComes { at, of } = *cause else {
                continue;
            };
            let condition = never.condition(at);
            let state = condition
                .and_then(|it| it.path(&["ByValueCondition", "StoryboardElementStateCondition"]));
            let Some(state) = state.filter(|it| !follows(timeline, *it, of, never.place)) else {
                continue;
            };
            let text = format!(
                "{}; {}{}",
                timeline::state_never_comes(scenario, timeline, state, of),
                never.so,
                differs(&never)
            );
            found.about(state, "state", text);
        }
    }
}

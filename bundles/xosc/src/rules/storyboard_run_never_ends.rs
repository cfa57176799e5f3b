use crate::families::timeline::{self, Never, differs};
use crate::families::triggers::edge_of_time;
use crate::prelude::*;
use qcbus_openscenario::wording::described;
use qcbus_openscenario::{Cause, Timeline};

pub const RULE: Rule<Scene> = Rule {
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(timeline) = scenario.timeline() else {
        return;
    };
    let Some(never) = timeline::never_ended(scenario, timeline) else {
        return;
    };
    let level = match never.is_certain {
        true => Level::Error,
        false => Level::Warning,
    };
    for cause in &never.causes {
        report(scenario, timeline, &never, *cause, level, found);
    }
}

fn report(
    scenario: &Scenario<'_>,
    timeline: &Timeline,
    never: &Never<'_, '_>,
    cause: Cause,
    level: Level,
    found: &mut Sink<'_>,
) {
    let (at, why) = match cause {
        Cause::StateNeverComes { at, of } => {
            let Some(condition) = never.condition(at) else {
                return;
            };
            let state = condition.path(&["ByValueCondition", "StoryboardElementStateCondition"]);
            let Some(state) = state else { return };
            let text = timeline::state_never_comes(scenario, timeline, state, of);
            let text = format!("{text}; {}{}", never.so, differs(never));
            found
                .about(state, "state", text)
                .level(level)
                .at(condition.node(), "the condition")
                .maybe_follows(timeline::start_within(scenario, timeline, of));
            return;
        }
        Cause::Impossible { at } => {
            let condition = never.condition(at);
            let Some(impossible) = condition.and_then(|it| scenario.impossible(it)) else {
                return;
            };
            let text = format!("{}; {}{}", described(&impossible), never.so, differs(never));
            found
                .about(impossible.element, impossible.attribute, text)
                .level(level);
            return;
        }
        Cause::Over { at } => {
            let edge = never.condition(at).and_then(edge_of_time);
            let why = edge.map(|no| no.why);
            (
                at,
                why.unwrap_or_else(|| "this condition is over when the run begins".to_owned()),
            )
        }
        Cause::Apart { other, .. } => {
            let why = "the conditions of this group are never true together";
            (other, why.to_owned())
        }
        Cause::AfterTheEnd { .. } | Cause::Skipped { .. } => return,
    };
    if let Some(condition) = never.condition(at) {
        let text = format!("{why}; {}{}", never.so, differs(never));
        found.about(condition, "", text).level(level);
    }
}

use crate::families::actions::stated;
use crate::families::triggers::{groups, holds_at_once, time};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(storyboard) = scenario.root().child("Storyboard") else {
        return;
    };
    // Without a story the early end has no effect.
    if storyboard.child("Story").is_none() {
        return;
    }
    let Some(trigger) = storyboard.child("StopTrigger") else {
        return;
    };
    for group in groups(trigger) {
        let Some(first) = group.first() else { continue };
        if !group.iter().all(|condition| holds_at_once(*condition)) {
            continue;
        }
        let shown = time(*first).and_then(|time| {
            let value = time.number("value")?;
            Some(format!(
                "`{}` {} s",
                time.word("rule")?,
                stated(time, "value", value)
            ))
        });
        let text = format!(
            "the storyboard stops when the simulation time is {}, which is true from the beginning; the run ends \
             before anything happens",
            shown.unwrap_or_default()
        );
        found.about(time(*first).unwrap_or(*first), "value", text);
    }
}

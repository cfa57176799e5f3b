use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for act in scenario.elements("Act") {
        let mut actions = act.descendants_named("Action");
        let first = actions.next();
        let more: Vec<_> = actions.collect();
        if let (Some(first), Some(second)) = (first, more.first()) {
            let text = format!(
                "the act has {} actions, which is outside the minimum subset; only one action per act is allowed",
                1 + more.len()
            );
            let finding = found.issue(act.node(), text);
            finding
                .at(first.node(), "the first action")
                .at(second.node(), "the second action");
        }
    }
}

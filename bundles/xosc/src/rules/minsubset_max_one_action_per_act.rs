use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_max_one_action_per_act",
    uids: &["asam.net:xosc:1.3.0:minsubset.max_one_action_per_act"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_max_one_action_per_act.md"),
    run,
    ..Rule::DEFAULTS
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

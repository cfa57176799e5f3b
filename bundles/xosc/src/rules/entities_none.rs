use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_entities_none",
    uids: &["qcbus.dev:xosc:1.0.0:entities.none"],
    level: Level::Warning,
    versions: "1.0.0..",
    after: super::READABLE,
    page: include_str!("entities_none.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(block) = scenario.root().child("Entities") else {
        return;
    };
    // Traffic actions may create entities.
    let has_traffic = scenario
        .elements_everywhere("TrafficAction")
        .next()
        .is_some();
    if scenario.form() == Form::Scenario && block.child("ScenarioObject").is_none() && !has_traffic
    {
        let text = "the scenario has no `ScenarioObject` and no traffic, so it has no participants";
        found.issue(block.node(), text);
    }
}

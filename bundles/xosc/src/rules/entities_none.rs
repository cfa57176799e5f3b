use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
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

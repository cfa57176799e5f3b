use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    // Before 1.2 the schema requires a story.
    versions: "1.2.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(storyboard) = scenario.root().child("Storyboard") else {
        return;
    };
    let Some(actions) = storyboard.path(&["Init", "Actions"]) else {
        return;
    };
    if actions.children().next().is_none() && storyboard.child("Story").is_none() {
        let text = "the storyboard has neither a story nor an action in `Init`; nothing happens in this scenario";
        found.about(storyboard, "", text);
    }
}

use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut stories = scenario.elements("Story");
    let Some(first) = stories.next() else {
        return;
    };
    for story in stories {
        let text =
            "an additional `Story` is outside the minimum subset; move its acts into the first";
        found
            .issue(story.node(), text)
            .at(first.node(), "the first story");
    }
}

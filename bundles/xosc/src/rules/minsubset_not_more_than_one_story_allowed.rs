use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_not_more_than_one_story_allowed",
    uids: &["asam.net:xosc:1.3.0:minsubset.not_more_than_one_story_allowed"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_not_more_than_one_story_allowed.md"),
    run,
    ..Rule::DEFAULTS
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

use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_maximum_execution_count_is_one",
    uids: &["asam.net:xosc:1.3.0:minsubset.maximum_execution_count_is_one"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_maximum_execution_count_is_one.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for element in ["ManeuverGroup", "Event"]
        .into_iter()
        .flat_map(|name| scenario.elements(name))
    {
        let count = element.integer("maximumExecutionCount");
        if let Some(count) = count.filter(|count| *count > 1) {
            let text = format!(
                "the `maximumExecutionCount` is {count}, which is outside the minimum subset; only 1 is allowed"
            );
            let place = Place::attribute_or_node(element.node(), "maximumExecutionCount");
            found.issue(place, text);
        }
    }
}

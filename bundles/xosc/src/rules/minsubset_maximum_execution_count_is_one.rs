use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    default_on: false,
    run,
    ..Rule::after(READABLE)
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

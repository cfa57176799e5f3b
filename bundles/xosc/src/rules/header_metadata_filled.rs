use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(header) = scenario.root().child("FileHeader") else {
        return;
    };
    for (attribute, what) in [
        ("description", "the purpose of the file"),
        ("author", "the person to contact"),
    ] {
        if header
            .text(attribute)
            .is_some_and(|text| text.trim().is_empty())
        {
            let text = format!("the header's `{attribute}` is empty; it should state {what}");
            found.issue(Place::attribute_or_node(header.node(), attribute), text);
        }
    }
}

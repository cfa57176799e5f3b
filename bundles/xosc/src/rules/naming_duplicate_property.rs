use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for block in scenario.elements("Properties") {
        let mut first: HashMap<&str, Node<'_>> = HashMap::default();
        for property in block.node().children_named("Property") {
            let Some(name) = property.attr("name") else {
                continue;
            };
            let known = *first.entry(name).or_insert(property);
            if known == property {
                continue;
            }
            let value = |property: Node<'_>| property.attr("value").unwrap_or("").to_owned();
            let (level, what) = if value(known) == value(property) {
                (
                    Level::Information,
                    "is defined twice with the same value".to_owned(),
                )
            } else {
                let what = format!(
                    "is `{}` here and `{}` before; which one is used depends on the simulator",
                    value(property),
                    value(known)
                );
                (Level::Warning, what)
            };
            found
                .issue(
                    Place::attribute_or_node(property, "name"),
                    format!("the property `{name}` {what}"),
                )
                .level(level)
                .at(known, "the first property with this name");
        }
    }
}

use crate::families::names;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (element, name) in names::keys(scenario) {
        if name.contains("::") {
            let text = format!(
                "the name {} contains `::`, which joins names in references: `a::b` is the element `b` in `a`",
                quoted(element, "name", &name)
            );
            found.about(element, "name", text);
        }
    }
}

use crate::families::constraints;
use crate::families::declared;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for declaration in scenario.elements("ParameterDeclaration") {
        let Some(data_type) = declared::type_of(declaration, "parameterType") else {
            continue;
        };
        let groups = constraints::groups(declaration, data_type);
        // One group is enough. Without any, the parameter can have no value at all.
        let none_left = groups
            .iter()
            .all(|group| group.contradiction(data_type).is_some());
        for group in groups {
            if let Some((first, second)) = group.contradiction(data_type) {
                let text = format!(
                    "{} and {} exclude each other; no value of type `{}` satisfies this group",
                    first.shown(),
                    second.shown(),
                    data_type.word()
                );
                let finding = found
                    .issue(group.element.node(), text)
                    .at(first.element.node(), "the first of the two")
                    .at(second.element.node(), "the second of the two");
                if none_left {
                    finding.level(Level::Error);
                }
            }
        }
    }
}

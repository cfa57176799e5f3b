use crate::families::actions::acting;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for action in scenario.elements_everywhere("SynchronizeAction") {
        let Some(master) = action.text("masterEntityRef") else {
            continue;
        };
        let acting = acting(action).unwrap_or_default();
        if acting.iter().any(|entity| entity.name() == master) {
            let text = format!(
                "{} is the master and an actor of this action; an entity cannot arrive together with itself, so \
                 the master must be another entity",
                quoted(action, "masterEntityRef", &master)
            );
            found.about(action, "masterEntityRef", text);
        }
    }
}

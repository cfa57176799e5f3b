use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let actions = scenario.root().path(&["Storyboard", "Init", "Actions"]);
    let mut first = HashMap::new();
    for private in actions
        .into_iter()
        .flat_map(|actions| actions.children_named("Private"))
    {
        let Some(name) = private.text("entityRef") else {
            continue;
        };
        let Some(known) = first.get(&name).copied() else {
            first.insert(name, private.node());
            continue;
        };
        let text = format!(
            "`Init` has another `Private` of {}; all of its actions happen at the start, but the standard does \
             not define their order; one `Private` with all of them is easier to read",
            quoted(private, "entityRef", &name)
        );
        found
            .about(private, "entityRef", text)
            .at(known, "its first `Private`");
    }
}

use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for catalog in scenario.elements("Catalog") {
        let mut first: HashMap<&str, Node<'_>> = HashMap::default();
        for entry in catalog.node().children() {
            let Some(name) = entry.attr("name") else {
                continue;
            };
            let known = *first.entry(name).or_insert(entry);
            if known != entry {
                let text = format!(
                    "the catalog already has an entry `{name}`, a `{}`; which one a reference with this name \
                     uses depends on the simulator",
                    known.name()
                );
                found
                    .issue(entry, text)
                    .at(known, "the first entry with this name");
            }
        }
    }
}

use crate::prelude::*;
use foldhash::HashMap;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_reference_control_uniquely_resolvable_entity_references",
    uids: &["asam.net:xosc:1.2.0:reference_control.uniquely_resolvable_entity_references"],
    level: Level::Warning,
    versions: "1.2.0..",
    backport: Backport::Alike { since: "" },
    after: super::READABLE,
    page: include_str!("reference_control_uniquely_resolvable_entity_references.md"),
    run,
    ..Rule::DEFAULTS
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

use crate::families::catalogs::{self, Once};
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

/// Catalog, kind and name of an entry.
type Key<'d> = (&'d str, &'d str, &'d str);

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut entries: HashMap<Key<'_>, Vec<Node<'_>>> = HashMap::default();
    for (_, catalog) in scenario.catalogs() {
        let name = catalog.attr("name").unwrap_or("");
        for entry in catalog.children() {
            let key = (name, entry.name(), entry.attr("name").unwrap_or(""));
            entries.entry(key).or_default().push(entry);
        }
    }
    let mut ambiguous = Once::new();
    for (reference, to) in catalogs::references(scenario) {
        if let Resolution::Entry(entry) | Resolution::OtherLocation(entry) = to {
            let name = entry.catalog.attr("name").unwrap_or("");
            let key = (
                name,
                entry.node.name(),
                entry.node.attr("name").unwrap_or(""),
            );
            if entries.get(&key).is_some_and(|all| all.len() > 1) {
                ambiguous.add((key, entry.node.offset()), reference);
            }
        }
    }
    for (reference, count) in ambiguous.each() {
        let (Resolution::Entry(entry) | Resolution::OtherLocation(entry)) =
            scenario.resolution(reference)
        else {
            continue;
        };
        let name = entry.catalog.attr("name").unwrap_or("");
        let own = entry.node.attr("name").unwrap_or("");
        let all = entries.get(&(name, entry.node.name(), own));
        let all = all.map_or(&[][..], Vec::as_slice);
        let text = format!(
            "the entry `{own}` of the catalog `{name}` exists {} times; which one is used depends on the \
             simulator{}",
            all.len(),
            catalogs::further(count)
        );
        let mut finding = found.about(reference, "entryName", text);
        for (number, node) in (1..).zip(all.iter().take(8)) {
            finding = finding.at(*node, format!("entry {number}"));
        }
    }
}

use crate::families::catalogs::{self, Once};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut without = Once::new();
    let mut elsewhere = Once::new();
    for (reference, to) in catalogs::references(scenario) {
        match to {
            Resolution::NoLocation => without.add(catalogs::kinds(reference), reference),
            Resolution::OtherLocation(entry) => {
                elsewhere.add(entry.catalog.attr("name").unwrap_or(""), reference);
            }
            _ => {}
        }
    }
    for (reference, count) in without.each() {
        let kinds = catalogs::kinds(reference).iter();
        let text = format!(
            "no catalog can be found for this reference, because `CatalogLocations` has no {}{}",
            catalogs::listed(kinds.map(|kind| kind.location())).replace(", ", " or "),
            catalogs::further(count)
        );
        found.about(reference, "", text);
    }
    for (reference, count) in elsewhere.each() {
        let Resolution::OtherLocation(entry) = scenario.resolution(reference) else {
            continue;
        };
        let mut kinds = CatalogKind::ALL.into_iter();
        let Some(kind) = kinds.find(|kind| entry.node.is(kind.element())) else {
            continue;
        };
        let (name, location) = (entry.catalog.attr("name").unwrap_or(""), kind.location());
        let why = if scenario.catalog_directory(kind).is_some() {
            format!(
                "the directory of `{location}`, where a `{}` is expected",
                kind.element()
            )
        } else {
            format!("the directory of a `{location}`, which `CatalogLocations` does not have")
        };
        let text = format!(
            "the catalog `{name}` is in a directory of other catalogs and not in {why}; some simulators do not \
             find it{}",
            catalogs::further(count)
        );
        found
            .about(reference, "catalogName", text)
            .level(Level::Warning)
            .at(entry.node, "the entry");
    }
}

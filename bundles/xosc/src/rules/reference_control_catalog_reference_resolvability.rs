use crate::families::catalogs::{self, Fault, Once};
use crate::families::references::{hint_or_all, quoted};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    backport: Backport::None,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let faults = catalogs::faults(scenario, found.subject());
    let has = |kinds: &[CatalogKind], wanted: &[Fault]| {
        let mut all = kinds.iter().filter_map(|kind| faults.get(kind));
        all.any(|fault| wanted.contains(fault))
    };
    let mut no_catalog = Once::new();
    let mut no_entry = Once::new();
    for (reference, to) in catalogs::references(scenario) {
        let kinds = catalogs::kinds(reference);
        let names = (reference.text("catalogName"), reference.text("entryName"));
        match to {
            // A directory without catalogs is one fault and is reported there.
            Resolution::NoCatalog if !has(kinds, &[Fault::Said, Fault::Empty]) => {
                no_catalog.add((names.0, kinds), reference);
            }
            Resolution::NoEntry { .. } => no_entry.add((names, kinds), reference),
            _ => {}
        }
    }
    for (reference, count) in no_catalog.each() {
        let open = has(catalogs::kinds(reference), &[Fault::NoPath]);
        catalog(reference, count, open, found);
    }
    for (reference, count) in no_entry.each() {
        entry(reference, count, found);
    }
}

fn catalog(reference: Element<'_, '_>, count: u32, open: bool, found: &mut Sink<'_>) {
    let Some(name) = reference.text("catalogName") else {
        return;
    };
    let scenario = reference.scenario();
    let mut names: Vec<&str> = scenario
        .catalogs()
        .filter_map(|(_, catalog)| catalog.attr("name"))
        .collect();
    names.sort_unstable();
    names.dedup();
    let by_file = scenario.catalogs().find(|(_, catalog)| {
        let document = catalog.document();
        catalogs::stem(document.path()) == name
    });
    let mut text = format!(
        "the catalog {} is not found in the catalog locations",
        quoted(reference, "catalogName", &name)
    );
    if let Some((_, catalog)) = by_file {
        text.push_str(&format!(
            "; the file with this name contains the catalog `{}`, and the name in the file is the one that \
             counts",
            catalog.attr("name").unwrap_or("")
        ));
    } else if open {
        text.push_str(
            "; the path of the location is empty; which files it means depends on the simulator",
        );
    } else if names.is_empty() {
        text.push_str(", which contain no catalog files");
    } else {
        text.push_str(&hint_or_all(&name, names.iter().copied()));
    }
    text.push_str(&catalogs::further(count));
    let finding = found.about(reference, "catalogName", text);
    if by_file.is_some() || open {
        finding.level(Level::Warning);
    }
}

fn entry(reference: Element<'_, '_>, count: u32, found: &mut Sink<'_>) {
    let (Some(name), Resolution::NoEntry { catalog }) = (
        reference.text("entryName"),
        reference.scenario().resolution(reference),
    ) else {
        return;
    };
    let kinds = catalogs::kinds(reference);
    let fitting = catalog
        .children()
        .filter(|child| kinds.iter().any(|kind| child.is(kind.element())));
    let names: Vec<&str> = fitting.filter_map(|child| child.attr("name")).collect();
    let mut text = format!(
        "the catalog `{}` has no entry {}{}",
        catalog.attr("name").unwrap_or(""),
        quoted(reference, "entryName", &name),
        elsewhere(reference, &name).unwrap_or_else(|| hint_or_all(&name, names.iter().copied()))
    );
    text.push_str(&catalogs::further(count));
    found
        .about(reference, "entryName", text)
        .at(*catalog, "the catalog");
}

/// Returns the other catalog that contains the entry.
fn elsewhere(reference: Element<'_, '_>, name: &str) -> Option<String> {
    let kinds = catalogs::kinds(reference);
    let fits = |entry: Node<'_>| {
        entry.attr("name") == Some(name) && kinds.iter().any(|kind| entry.is(kind.element()))
    };
    let mut all = reference.scenario().catalogs();
    let (_, catalog) = all.find(|(_, catalog)| catalog.children().any(fits))?;
    let catalog = catalog.attr("name").filter(|name| !name.is_empty())?;
    Some(format!("; the catalog `{catalog}` has this entry"))
}

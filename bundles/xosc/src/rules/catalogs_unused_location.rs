use crate::families::catalogs;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario {
        return;
    }
    let mut used: Vec<CatalogKind> = Vec::new();
    for (reference, to) in catalogs::references(scenario) {
        used.extend(
            CatalogKind::ALL
                .into_iter()
                .filter(|kind| catalogs::is_use(reference, to, *kind)),
        );
        used.sort_unstable();
        used.dedup();
    }
    let subject = found.subject();
    let unused: Vec<_> = CatalogKind::ALL
        .into_iter()
        .filter(|kind| !used.contains(kind))
        .filter_map(|kind| scenario.catalog_directory(kind))
        // The bus reports a missing directory. An empty path means that there is none.
        .filter(|directory| catalogs::missing(subject, directory.node()).is_none())
        .filter(|directory| {
            directory
                .text("path")
                .is_none_or(|path| !path.trim().is_empty())
        })
        .filter_map(|directory| directory.node().parent())
        .collect();
    let Some((first, others)) = unused.split_first() else {
        return;
    };
    let text = format!(
        "no reference uses the catalogs of {}",
        catalogs::listed(unused.iter().map(|location| location.name()))
    );
    let mut finding = found.issue(*first, text);
    for other in others {
        finding = finding.at(*other, "another unused location");
    }
}

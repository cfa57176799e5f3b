use crate::families::catalogs::{self, Fault};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for kind in CatalogKind::ALL {
        let fault = catalogs::fault_of(scenario, found.subject(), kind);
        let Some((fault, directory)) = fault.zip(scenario.catalog_directory(kind)) else {
            continue;
        };
        let path = directory.text("path").unwrap_or_default();
        let place = Place::attribute_or_node(directory.node(), "path");
        let mut uses = catalogs::references(scenario);
        match fault {
            Fault::File => {
                let used = uses.any(|(reference, to)| catalogs::is_use(reference, to, kind));
                let text = format!(
                    "`{path}` is a file, but a catalog location must be the directory that contains the catalogs"
                );
                let level = if used { Level::Error } else { Level::Warning };
                found.issue(place, text).level(level);
            }
            Fault::Empty => {
                let user = uses.find(|(reference, to)| {
                    matches!(to, Resolution::NoCatalog)
                        && catalogs::kinds(*reference).contains(&kind)
                });
                if let Some((user, _)) = user {
                    let name = user.text("catalogName").unwrap_or_default();
                    let text = format!(
                        "`{path}` contains no `.xosc` file, but the scenario refers to the catalog `{name}`"
                    );
                    found
                        .issue(place, text)
                        .at(user.node(), "a reference to it");
                }
            }
            Fault::Said | Fault::NoPath => {}
        }
    }
}

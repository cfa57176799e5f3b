use crate::families::catalogs;
use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for kind in CatalogKind::ALL {
        let Some(directory) = scenario.catalog_directory(kind) else {
            continue;
        };
        let Some(path) = directory.text("path") else {
            continue;
        };
        // If the directory was not found, the bus reports it. The path would only be the reason.
        if catalogs::missing(found.subject(), directory.node()).is_some() {
            continue;
        }
        let Some(why) = why(path.trim()) else {
            continue;
        };
        let text = format!("the path {} {why}", quoted(directory, "path", &path));
        found.issue(Place::attribute_or_node(directory.node(), "path"), text);
    }
}

/// Returns the reason why a path is not found on another machine.
fn why(path: &str) -> Option<&'static str> {
    let mut start = path.chars();
    let is_drive = start
        .next()
        .is_some_and(|first| first.is_ascii_alphabetic())
        && start.next() == Some(':');
    if is_drive || path.starts_with(['/', '\\']) || path.starts_with("file://") {
        return Some(
            "is absolute and leads to the directory on this machine only; a path relative to the scenario works \
             everywhere",
        );
    }
    path.contains('\\')
        .then_some("has backslashes, which are separators on Windows only; `/` works everywhere")
}

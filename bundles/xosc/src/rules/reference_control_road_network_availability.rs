use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(network) = scenario.root().child("RoadNetwork") else {
        return;
    };
    for file in network.children() {
        if !file.is("SceneGraphFile") && !file.is("LogicFile") {
            continue;
        }
        let Some(path) = file.text("filepath") else {
            continue;
        };
        if let Some(why) = only_here(&path) {
            let text = format!(
                "the path {} {why}; a path relative to the directory of the scenario works everywhere",
                quoted(file, "filepath", &path)
            );
            found
                .about(file, "filepath", text)
                .level(Level::Information);
        } else if path.contains('\\') {
            let text = format!(
                "the path {} has backslashes, which are separators on Windows only; `/` works everywhere",
                quoted(file, "filepath", &path)
            );
            found.about(file, "filepath", text);
        } else if file.is("SceneGraphFile") {
            scene(file, &path, found);
        }
    }
}

/// Returns the reason why a path is valid on one machine only.
fn only_here(path: &str) -> Option<&'static str> {
    let path = path.trim();
    let path = path.strip_prefix("file://").unwrap_or(path);
    let mut letters = path.chars();
    let drive = (letters.next(), letters.next());
    if matches!(drive, (Some(letter), Some(':')) if letter.is_ascii_alphabetic()) {
        return Some("refers to a drive of a single Windows machine");
    }
    if path.starts_with("\\\\") {
        return Some("refers to a share of a single network");
    }
    let top = path
        .strip_prefix('/')
        .and_then(|path| path.split('/').next());
    let is_private = path.starts_with('~') || matches!(top, Some("home" | "Users" | "root"));
    is_private.then_some("leads into the home directory of a single user")
}

/// Checks the path of a scene graph by its text only, because files of this kind are not opened.
fn scene(file: Element<'_, '_>, path: &str, found: &mut Sink<'_>) {
    let path = path.trim();
    if path.ends_with(['/', '\\']) || path == "." || path == ".." {
        let text = format!(
            "the path {} is a directory; `SceneGraphFile` must name a file; leave it out if there is none",
            quoted(file, "filepath", path)
        );
        found.about(file, "filepath", text);
    }
}

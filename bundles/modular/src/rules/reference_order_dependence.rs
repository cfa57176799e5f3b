use std::collections::BTreeMap;

use crate::assembly::{Assembly, Modular};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for document in assembly.scenarios() {
        let references: Vec<(Node<'_>, &str)> = document
            .elements("ScenarioReference")
            .filter_map(|node| Some((node, node.attr("scenarioFileName")?)))
            .collect();
        let mut first: BTreeMap<&str, Node<'_>> = BTreeMap::new();
        for &(node, name) in &references {
            first.entry(name).or_insert(node);
        }
        for (node, name) in references {
            let Some(stem) = name.strip_suffix(".xosc") else {
                continue;
            };
            let archive = format!("{stem}.mosc");
            if let Some(&other) = first.get(archive.as_str())
                && let Some(target) = assembly.target(node)
                && let is_later = other.offset() < node.offset()
                && let Some((level, text)) = trouble(target, name, &archive, is_later)
            {
                let place = Place::attribute_or_node(node, "scenarioFileName");
                let there = Place::attribute_or_node(other, "scenarioFileName");
                let finding = found.issue(place, text).level(level);
                finding.at(there, "the reference to the archive");
            }
        }
    }
}

/// Describes the problem of a reference to `name.xosc` beside one to `name.mosc`.
fn trouble(
    target: Document<'_>,
    name: &str,
    archive: &str,
    is_later: bool,
) -> Option<(Level, String)> {
    let file = archive.rsplit(['/', '\\']).next().unwrap_or(archive);
    let is_archive = target.path().ends_with(&format!("{file}!main.xosc"));
    let (level, text) = match (is_archive, is_later) {
        (true, true) => (
            Level::Warning,
            format!(
                "`{name}` does not exist: the reference tool creates a file of this name when it expands \
                 `{archive}` for an earlier reference; refer to `{archive}`, which does not depend on the order"
            ),
        ),
        (true, false) => (
            Level::Error,
            format!(
                "`{name}` does not exist, and only a later reference names `{archive}`, from which the reference \
                 tool would create it, so that it stops here; refer to `{archive}`"
            ),
        ),
        (false, true) => (
            Level::Warning,
            format!(
                "`{name}` exists, but an earlier reference names `{archive}`, and the reference tool overwrites \
                 `{name}` when it expands the archive; give one of the two another name"
            ),
        ),
        (false, false) => return None,
    };
    Some((level, text))
}

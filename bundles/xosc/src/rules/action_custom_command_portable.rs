use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut kinds: Vec<(Element<'_, '_>, String, usize)> = Vec::new();
    let mut known: HashMap<String, usize> = HashMap::new();
    for command in scenario.elements_everywhere("CustomCommandAction") {
        let Some(kind) = command.text("type") else {
            continue;
        };
        let next = kinds.len();
        let at = *known.entry(kind.to_string()).or_insert(next);
        match kinds.get_mut(at) {
            Some((_, _, count)) => *count += 1,
            None => kinds.push((command, kind.into_owned(), 1)),
        }
    }
    for (command, kind, count) in kinds {
        let often = if count == 1 {
            String::new()
        } else {
            format!(" (used {count} times)")
        };
        let text = format!(
            "the effect of the custom command `{kind}`{often} is known only to the simulator that it was written \
             for; others skip it or stop"
        );
        found.about(command, "type", text);
    }
}

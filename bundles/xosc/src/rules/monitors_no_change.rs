use crate::families::declared;
use crate::prelude::*;
use foldhash::{HashSet, HashSetExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    versions: "1.3.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !scenario.storyboard().is_complete() {
        return;
    }
    let declared = declared::MONITORS.by_name(scenario);
    let mut changed = HashSet::new();
    let mut same = Vec::new();
    for (action, name) in declared::MONITORS.references(scenario, &["SetMonitorAction"]) {
        let Some(declaration) = declared.get(&*name) else {
            continue;
        };
        let (first, set) = (declaration.flag("value"), action.flag("value"));
        if first.is_some() && first == set {
            same.push((action, *declaration, name));
        } else {
            changed.insert(name);
        }
    }
    let dangling = declared::MONITORS.dangling(scenario, &["SetMonitorAction"]);
    for (action, declaration, name) in same {
        if !changed.contains(&name) && !dangling.may_mean(&name) {
            let value = action.text("value").unwrap_or_default();
            let text = format!(
                "the monitor `{name}` is set to `{value}`, which is its initial value, and no action sets it to \
                 another value"
            );
            found
                .about(action, "value", text)
                .at(declaration.node(), "its declaration");
        }
    }
}

use crate::families::declared;
use crate::prelude::*;

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
    let set = declared::MONITORS.names(scenario, &["SetMonitorAction"]);
    let dangling = declared::MONITORS.dangling(scenario, &["SetMonitorAction"]);
    for declaration in declared::MONITORS.declarations(scenario) {
        let name = declaration.written("name").unwrap_or("");
        if !set.contains(bare(name)) && !dangling.may_mean(name) {
            let text = format!(
                "no `SetMonitorAction` sets the monitor `{name}`, so it reports its initial value throughout the \
                 run"
            );
            found.issue(declaration.node(), text);
        }
    }
}

use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let document = scenario.document();
    let path = document.path();
    let name = path.rsplit(['/', '\\']).next().unwrap_or(path);
    // Archives of modular scenarios have their own file kind.
    if name.ends_with(".xosc") || name.ends_with(".mosc") {
        return;
    }
    let text =
        format!("the file is named `{name}`, but the name of such a file should end with `.xosc`");
    found.issue((document, 0), text).here("the file");
}

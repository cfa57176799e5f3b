use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_general_file_ending",
    uids: &["asam.net:xosc:1.0.0:general.file_ending"],
    level: Level::Warning,
    after: super::READABLE,
    page: include_str!("general_file_ending.md"),
    run,
    ..Rule::DEFAULTS
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

use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_stop_triggers_not_allowed_except_in_storyboard",
    uids: &["asam.net:xosc:1.3.0:minsubset.stop_triggers_not_allowed_except_in_storyboard"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_stop_triggers_not_allowed_except_in_storyboard.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for act in scenario.elements("Act") {
        for trigger in act.children_named("StopTrigger") {
            minsubset::outside(trigger, "only the storyboard may have one", found);
        }
    }
}

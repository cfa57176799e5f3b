use crate::families::triggers;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_storyboard_event_never_starts",
    uids: &["qcbus.dev:xosc:1.0.0:storyboard.event_never_starts"],
    level: Level::Warning,
    versions: "1.0.0..",
    after: super::READABLE,
    page: include_str!("storyboard_event_never_starts.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let remedy = if scenario.version() >= (1, 1) {
        "an event without `StartTrigger` starts with its act"
    } else {
        "to start an event with its act, use a condition such as a simulation time greater than 0"
    };
    triggers::empty_starts(scenario, "Event", |_| true, remedy, found);
}

use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_data_type_time_format",
    uids: &["asam.net:xosc:1.0.0:data_type.time_format"],
    after: super::READABLE,
    page: include_str!("data_type_time_format.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let kinds = [ValueFaultKind::Declared, ValueFaultKind::Parameter];
    for fault in values::faults(scenario, &kinds) {
        if values::is_about_time(fault) {
            let level = if values::is_basic_zone(scenario, fault) {
                Level::Warning
            } else {
                Level::Error
            };
            values::say(fault, found).level(level);
        }
    }
}

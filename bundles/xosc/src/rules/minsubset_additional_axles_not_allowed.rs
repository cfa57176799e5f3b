use crate::families::minsubset;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_asam_xosc_minsubset_additional_axles_not_allowed",
    uids: &["asam.net:xosc:1.3.0:minsubset.additional_axles_not_allowed"],
    level: Level::Information,
    versions: "1.3.0..",
    after: super::READABLE,
    default_on: false,
    page: include_str!("minsubset_additional_axles_not_allowed.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let instead = "a vehicle may have only a front and a rear axle";
    minsubset::none(scenario, &["AdditionalAxle"], instead, found);
}

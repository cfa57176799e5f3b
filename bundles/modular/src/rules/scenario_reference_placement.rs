use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_scenario_reference_placement",
    uids: &["qcbus.dev:mosc:1.0.0:scenario_reference.placement"],
    page: include_str!("scenario_reference_placement.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(
        assembly,
        found,
        &[What::Placement],
        "the element that contains it",
    );
}

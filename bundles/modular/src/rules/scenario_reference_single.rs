use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_scenario_reference_single",
    uids: &["qcbus.dev:mosc:1.0.0:scenario_reference.single"],
    page: include_str!("scenario_reference_single.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(
        assembly,
        found,
        &[What::SecondReference],
        "the first reference of the group",
    );
}

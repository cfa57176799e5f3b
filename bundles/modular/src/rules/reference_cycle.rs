use qcbus_sdk::modular::What;
use qcbus_sdk::{Rule, Sink};

use crate::assembly::{Assembly, Modular, say_all};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_reference_cycle",
    uids: &["qcbus.dev:mosc:1.0.0:reference.cycle"],
    page: include_str!("reference_cycle.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(
        assembly,
        found,
        &[What::Cycle],
        "the scenario that is referred to",
    );
}

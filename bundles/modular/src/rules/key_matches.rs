use qcbus_sdk::modular::What;
use qcbus_sdk::{Rule, Sink};

use crate::assembly::{Assembly, Modular, say};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_key_matches",
    uids: &["qcbus.dev:mosc:1.0.0:key.matches"],
    page: include_str!("key_matches.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::KeyUnmatched]) {
        say(found, problem, "the group that is referred to");
    }
}

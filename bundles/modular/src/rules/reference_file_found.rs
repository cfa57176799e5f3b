use qcbus_sdk::modular::What;
use qcbus_sdk::{Rule, Sink};

use crate::assembly::{Assembly, Modular, say};

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_reference_file_found",
    uids: &["qcbus.dev:mosc:1.0.0:reference.file_found"],
    page: include_str!("reference_file_found.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::FileNotFound, What::Unreadable]) {
        say(found, problem, "the file that is referred to");
    }
}

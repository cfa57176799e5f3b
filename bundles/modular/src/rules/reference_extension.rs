use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_reference_extension",
    uids: &["qcbus.dev:mosc:1.0.0:reference.extension"],
    page: include_str!("reference_extension.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(
        assembly,
        found,
        &[What::Extension],
        "the file that is referred to",
    );
}

use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_group_reference_duplicate",
    uids: &["qcbus.dev:mosc:1.0.0:group_reference.duplicate"],
    page: include_str!("group_reference_duplicate.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(
        assembly,
        found,
        &[What::GroupTwice],
        "the previous reference",
    );
}

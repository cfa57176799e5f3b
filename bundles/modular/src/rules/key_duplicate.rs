use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub static RULE: Rule<Modular> = Rule {
    id: "check_qcbus_mosc_key_duplicate",
    uids: &["qcbus.dev:mosc:1.0.0:key.duplicate"],
    level: Level::Warning,
    page: include_str!("key_duplicate.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    say_all(assembly, found, &[What::KeyTwice], "the previous key");
}

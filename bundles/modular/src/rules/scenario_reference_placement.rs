use crate::assembly::{Assembly, Modular, say_all};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
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

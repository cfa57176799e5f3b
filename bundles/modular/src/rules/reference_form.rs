use crate::assembly::{Assembly, Modular, say, say_all};
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::DirectForm]) {
        let node = problem.at.node();
        let mut references = assembly.expansion.references.iter();
        let target = references
            .find(|it| it.node == node)
            .and_then(|it| it.target);
        let file = target.and_then(|target| assembly.expansion.pieces.get(target)?.document.root());
        let finding = say(found, problem, "").level(Level::Warning);
        if let Some(file) = file {
            finding.at(file, "the file whose groups are taken");
        }
    }
    say_all(
        assembly,
        found,
        &[What::ForeignElement, What::ForeignAttribute],
        "",
    );
    say_all(
        assembly,
        found,
        &[What::MixedForm],
        "the reference that names groups",
    );
}

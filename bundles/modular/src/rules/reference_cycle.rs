use crate::assembly::{Assembly, Modular, place};
use crate::families::finds::Finds;
use crate::prelude::*;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let mut finds = Finds::default();
    for problem in assembly.problems(&[What::Cycle]) {
        match assembly.target(problem.at.node()) {
            Some(back) => {
                let there = "the scenario that it leads back to";
                finds.of_file(problem.at, back, there, problem.text.clone());
            }
            None => {
                found.issue(place(problem.at), problem.text.clone());
            }
        }
    }
    finds.say(found);
}

use crate::assembly::{Assembly, Modular, place, say};
use crate::families::file_faults::has_own_rule;
use crate::families::finds::Finds;
use crate::prelude::*;
use qcbus_messages::{Absence, DocumentRole, MissingDocument};

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for problem in assembly.problems(&[What::FileNotFound]) {
        match other_reason(assembly, problem.at.node()) {
            Some(text) => {
                found.issue(place(problem.at), text);
            }
            None => {
                say(found, problem, "the file that is referred to");
            }
        }
    }
    let mut finds = Finds::default();
    for problem in assembly.problems(&[What::Unreadable]) {
        // Other rules report faults of the checked file, for example those of the bundle for
        // OpenSCENARIO.
        let target = assembly.target(problem.at.node());
        if let Some(target) = target.filter(|target| !has_own_rule(*target)) {
            let there = "the file that is referred to";
            finds.of_file(problem.at, target, there, problem.text.clone());
        }
    }
    finds.say(found);
}

/// Returns why a file could not be read although it exists, or why it was not looked for.
fn other_reason(assembly: &Assembly<'_>, reference: Node<'_>) -> Option<String> {
    let name = reference.attr("scenarioFileName")?;
    if name.trim().is_empty() {
        return None;
    }
    let mut missing = assembly.subject.missing().iter();
    let missing = missing.find(|missing| {
        missing.role == DocumentRole::Scenario
            && missing.reference == name
            && is_at(assembly, missing, reference)
    })?;
    let is_found_nowhere = matches!(missing.why, Absence::NotThere);
    (!is_found_nowhere).then(|| format!("`{name}` {}", missing.why))
}

fn is_at(assembly: &Assembly<'_>, missing: &MissingDocument, reference: Node<'_>) -> bool {
    let position = reference.position();
    match &missing.within {
        Some(within) => {
            (within.path.as_str(), within.row, within.column)
                == (position.path, position.row, position.column)
        }
        None => {
            reference.document().path() == assembly.root().path()
                && missing.referred_at == reference.offset()
        }
    }
}

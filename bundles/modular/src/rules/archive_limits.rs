use crate::assembly::{Assembly, Modular, say};
use crate::families::file_faults::{LIMITS, of_archives};
use crate::prelude::*;
use qcbus_messages::path_text::name_of;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for (document, fault) in of_archives(assembly, LIMITS) {
        let archive = archive_of(document.path()).unwrap_or("");
        let text = format!("`{}`: {}", name_of(archive), fault.text);
        assembly.say_of(found, (document, 0), text, "the archive");
    }
    for problem in assembly.problems(&[What::Size]) {
        say(found, problem, "the group that is referred to");
    }
}

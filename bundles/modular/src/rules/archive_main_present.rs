use crate::assembly::{Assembly, Modular};
use crate::families::file_faults::{ARCHIVE, of_archives};
use crate::prelude::*;
use qcbus_messages::path_text::name_of;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for (document, fault) in of_archives(assembly, ARCHIVE) {
        let path = document.path();
        let archive = path.rsplit_once('!').map_or(path, |(archive, _)| archive);
        let remedy = match fault.code {
            FaultCode::ArchiveMemberMissing => {
                "a modular scenario needs `main.xosc`, with this exact spelling and not in a folder of the \
                 archive"
            }
            _ => "pack the scenario again",
        };
        let text = format!("`{}`: {}; {remedy}", name_of(archive), fault.text);
        assembly.say_of(found, (document, 0), text, "the archive");
    }
}

use std::collections::BTreeSet;

use crate::assembly::{Assembly, Modular};
use crate::families::file_faults::NAMES;
use crate::prelude::*;
use qcbus_messages::Absence;
use qcbus_messages::path_text::name_of;
use qcbus_sdk::modular::stays_inside;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Information,
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    if !is_known(assembly) {
        return;
    }
    let used = used(assembly);
    for archive in assembly.archives() {
        let path = format!("{}!main.xosc", archive.path);
        let mut scenarios = assembly.scenarios();
        let Some(main) = scenarios.find(|document| document.path() == path) else {
            continue;
        };
        // Another rule reports members with names that lead out of the archive.
        for member in archive.members().filter(|member| stays_inside(member.name)) {
            if used.contains(format!("{}!{}", archive.path, member.name).as_str()) {
                continue;
            }
            let name = member.name;
            let advice = match name {
                _ if name.ends_with(".mosc") => "refer to it, or remove it",
                _ if name.ends_with(".xosc") => {
                    "refer to it, or remove it; catalogs are read from beside the archive, not from inside it"
                }
                _ => {
                    "only scenarios are read from archives, and maps are read from beside them; remove it"
                }
            };
            let archive = name_of(archive.path);
            let text =
                format!("no reference leads to the member `{name}` of `{archive}`; {advice}");
            assembly.say_of(found, (main, 0), text, "the archive");
        }
    }
}

/// Returns the paths of the scenarios and of all archives around them.
fn used<'d>(assembly: &Assembly<'d>) -> BTreeSet<&'d str> {
    let mut used = BTreeSet::new();
    for document in assembly.scenarios() {
        let mut path = document.path();
        while used.insert(path)
            && let Some((around, _)) = path.rsplit_once('!')
        {
            path = around;
        }
    }
    used
}

/// Checks whether all references were read and followed. Otherwise the use is unknown.
fn is_known(assembly: &Assembly<'_>) -> bool {
    let mut missing = assembly.subject.missing().iter();
    let mut faults = assembly.scenarios().flat_map(|document| document.faults());
    let is_cut = |why: &Absence| matches!(why, Absence::TooMany { .. } | Absence::TooDeep { .. });
    let hides = |code: FaultCode| code.makes_partial() && !NAMES.contains(&code);
    !missing.any(|missing| is_cut(&missing.why)) && !faults.any(|fault| hides(fault.code))
}

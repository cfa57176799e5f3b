use crate::assembly::{Assembly, Modular, say};
use crate::families::file_faults::{NAMES, of_archives};
use crate::prelude::*;
use qcbus_messages::path_text::name_of;
use qcbus_sdk::modular::has_only_backslashes;
use qcbus_sdk::modular::stays_inside;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for (document, fault) in of_archives(assembly, NAMES) {
        let archive = archive_of(document.path()).unwrap_or("");
        let why = match fault.code {
            FaultCode::ArchiveDuplicate => {
                "other tools may read another one; keep only one of them"
            }
            FaultCode::ArchiveBackslash => {
                "some tools treat it as a path separator, others as part of the name; pack the archive with `/`"
            }
            _ => {
                "a tool that unpacks the archive, such as the reference tool, may overwrite other files; members \
                 must be files with relative names, with `/` and without `..`"
            }
        };
        let text = format!("`{}`: {}; {why}", name_of(archive), fault.text);
        assembly.say_of(found, (document, 0), text, "the archive");
    }
    for problem in assembly.problems(&[What::Escapes]) {
        say(found, problem, "the file that is referred to");
    }
    for document in assembly.scenarios() {
        if archive_of(document.path()).is_none() {
            say_unpackable(assembly, document, found);
        }
    }
}

/// Reports references of a scenario outside of archives that would not work in an archive.
fn say_unpackable(assembly: &Assembly<'_>, document: Document<'_>, found: &mut Sink<'_>) {
    for reference in document.elements("ScenarioReference") {
        let name = reference.attr("scenarioFileName").unwrap_or("");
        // A file on another machine is never found. Another rule reports that.
        if name.trim().is_empty() || name.contains("://") || stays_inside(name) {
            continue;
        }
        let text = match has_only_backslashes(name) {
            true => format!(
                "`{name}` cannot be packed into an archive as it is: names in archives use `/` as separator; \
                 write `{}`",
                name.replace('\\', "/")
            ),
            false => format!(
                "`{name}` cannot be packed into an archive: there, the file must be in the archive or in a \
                 directory of the search path; name it without `..`, root, drive and backslash"
            ),
        };
        let place = Place::attribute_or_node(reference, "scenarioFileName");
        let finding = found.issue(place, text).level(Level::Warning);
        if let Some(target) = assembly.target(reference) {
            finding.at((target, 0), "the file that is referred to");
        }
    }
}

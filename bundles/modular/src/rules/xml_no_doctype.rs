use crate::assembly::{Assembly, Modular};
use crate::families::file_faults::{DOCTYPES, of};
use crate::prelude::*;
use qcbus_messages::path_text::name_of;

pub const RULE: Rule<Modular> = Rule {
    run,
    ..Rule::DEFAULTS
};

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    let refused: Vec<_> = of(assembly, DOCTYPES).collect();
    for (document, fault) in &refused {
        let text = format!(
            "`{}` has a document type declaration, which is refused, with all entities that it declares: the \
             reference tool reads it and copies what the entities name, including local files, into the result; \
             remove it and write the values themselves",
            name_of(document.path())
        );
        assembly.say_of(found, (*document, fault.offset), text, "the declaration");
    }
    for document in assembly.scenarios() {
        let is_said = refused
            .iter()
            .any(|(other, _)| other.path() == document.path());
        let Some(at) = bare(document).filter(|_| !is_said) else {
            continue;
        };
        let text = format!(
            "`{}` has a document type declaration that contains only the name of the root; it is harmless and is \
             lost when the reference tool expands the scenario; remove it",
            name_of(document.path())
        );
        let finding = assembly.say_of(found, (document, at), text, "the declaration");
        finding.level(Level::Information);
    }
}

/// Returns the offset of a document type declaration among comments and processing instructions.
fn bare(document: Document<'_>) -> Option<u32> {
    let source = document.sources().next()?;
    let root = document.root()?.offset().checked_sub(source.start)?;
    let prolog = document.source_text(&source).get(..root as usize)?;
    let mut at = 0;
    loop {
        at += prolog.get(at..)?.find('<')?;
        let rest = prolog.get(at..)?;
        let end = match rest {
            _ if rest.starts_with("<!DOCTYPE") => return u32::try_from(at).ok(),
            _ if rest.starts_with("<!--") => "-->",
            _ => "?>",
        };
        at += rest.find(end)? + end.len();
    }
}

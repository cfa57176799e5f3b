use crate::assembly::{Assembly, Modular};
use crate::families::file_faults::of;
use crate::prelude::*;
use qcbus_messages::path_text::name_of;

pub const RULE: Rule<Modular> = Rule {
    level: Level::Warning,
    run,
    ..Rule::DEFAULTS
};

/// Encoding faults without loss. Bytes that cannot be read are a fault of the file itself.
const READ_NEVERTHELESS: &[FaultCode] =
    &[FaultCode::EncodingTranscoded, FaultCode::EncodingMismatch];

fn run(assembly: &Assembly<'_>, found: &mut Sink<'_>) {
    for document in assembly.scenarios().filter(has_mark) {
        let text = format!(
            "`{}` begins with a byte order mark (U+FEFF), which the reference tool treats as content and stops; \
             store it without one",
            name_of(document.path())
        );
        assembly.say_of(found, (document, 0), text, "the byte order mark");
    }
    for (document, fault) in of(assembly, READ_NEVERTHELESS) {
        let text = format!(
            "`{}`: {}; the reference tool refuses or damages such a file: store it as plain UTF-8 and declare \
             UTF-8 in its XML declaration",
            name_of(document.path()),
            fault.text
        );
        assembly.say_of(found, (document, fault.offset), text, "here");
    }
}

fn has_mark(document: &Document<'_>) -> bool {
    let source = document.sources().next();
    source.is_some_and(|source| {
        let bytes = document.source_bytes(&source);
        bytes.starts_with("\u{FEFF}".as_bytes())
    })
}

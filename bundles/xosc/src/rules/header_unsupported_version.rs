use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    // The rule about the header reports a missing version or one that is no number.
    let header = document.root().and_then(|root| root.child("FileHeader"));
    let (Some(header), Some(version)) = (header, found.version()) else {
        return;
    };
    let (major, minor) = (version.major, version.minor);
    let why = match (major, minor) {
        (1, 0..=4) => return,
        (0, _) => {
            "this version was a draft with other elements, which current simulators do not read; the file is not \
             checked any further"
        }
        (1, _) => {
            "the file is checked as if it had the newest of them; later additions are not known"
        }
        (2.., _) => {
            "this version is another language, which is not written in XML; the file is not checked any further"
        }
    };
    let text = format!(
        "the file declares version {major}.{minor}, but only 1.0 to 1.4 are supported; {why}"
    );
    let attribute = if major == 1 { "revMinor" } else { "revMajor" };
    found.issue(Place::attribute_or_node(header, attribute), text);
    if major != 1 {
        found.leave_open(version);
    }
}

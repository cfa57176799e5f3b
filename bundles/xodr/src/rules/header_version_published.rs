use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    // The rule about the header reports a version that is missing or not a number.
    let header = document.root().and_then(|root| root.child("header"));
    let (Some(header), Some(version)) = (header, found.version()) else {
        return;
    };
    let (level, why) = match (version.major, version.minor) {
        (1, 0..=9) => return,
        (0, _) => (
            Level::Warning,
            "earlier versions were drafts that current readers do not know, so it cannot be judged",
        ),
        (1, 10) => (
            Level::Warning,
            "the next version is not known yet; the file is checked as version 1.9",
        ),
        (1, _) => (
            Level::Error,
            "the rules for such a file are undefined; it is checked as version 1.9",
        ),
        _ => (
            Level::Error,
            "the rules for such a file are undefined; it is checked by the rules of 1.9 as far as they apply",
        ),
    };
    let text = format!(
        "the file says that its version is {}.{}; the published versions are 1.0 to 1.9; {why}",
        version.major, version.minor
    );
    let attribute = if version.major == 1 {
        "revMinor"
    } else {
        "revMajor"
    };
    found
        .issue(Place::attribute_or_node(header, attribute), text)
        .level(level);
    if version.major == 0 {
        found.leave_open(version);
    }
}

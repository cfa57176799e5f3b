use crate::families::catalogs::{self, Once};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Information,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(own) = scenario
        .root()
        .child("FileHeader")
        .and_then(|header| version(header.node()))
    else {
        return;
    };
    // An unknown version of the language is reported once, at the header.
    if own.0 > 1 {
        return;
    }
    let mut newer = Once::new();
    for (reference, to) in catalogs::references(scenario) {
        let (Resolution::Entry(entry) | Resolution::OtherLocation(entry)) = to else {
            continue;
        };
        let Some((header, version)) = header(entry.node) else {
            continue;
        };
        if version > own || version.0 != own.0 {
            newer.add((header.document().path(), version), reference);
        }
    }
    for (reference, count) in newer.each() {
        let (Resolution::Entry(entry) | Resolution::OtherLocation(entry)) =
            scenario.resolution(reference)
        else {
            continue;
        };
        let Some((header, version)) = header(entry.node) else {
            continue;
        };
        let which = if version > own { "newer" } else { "much older" };
        let text = format!(
            "the catalog `{}` has OpenSCENARIO version {}.{}, {which} than {}.{} of the scenario; a simulator \
             that reads it with the version of the scenario may not understand it{}",
            entry.catalog.attr("name").unwrap_or(""),
            version.0,
            version.1,
            own.0,
            own.1,
            catalogs::further(count)
        );
        let level = if version.0 == own.0 {
            Level::Information
        } else {
            Level::Warning
        };
        found
            .about(reference, "catalogName", text)
            .level(level)
            .at(header, "the header of the catalog");
    }
}

fn header(entry: Node<'_>) -> Option<(Node<'_>, (u16, u16))> {
    let root = entry.ancestors().last()?;
    let header = root.child("FileHeader")?;
    Some((header, version(header)?))
}

fn version(header: Node<'_>) -> Option<(u16, u16)> {
    let part = |name| header.attr(name)?.trim().parse().ok();
    Some((part("revMajor")?, part("revMinor")?))
}

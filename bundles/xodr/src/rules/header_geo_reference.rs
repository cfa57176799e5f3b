use crate::families::georeference::flaws;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let header = map.header().into_iter();
    for reference in header.flat_map(|header| header.children_named("geoReference")) {
        check(reference, found);
    }
}

fn check(reference: Node<'_>, found: &mut Sink<'_>) {
    let text = reference.text();
    let text = text.trim();
    if !text.is_empty() {
        for flaw in flaws(text) {
            found.issue(reference, flaw.text).level(flaw.level);
        }
        return;
    }
    // The included content is not available here.
    if reference.child("include").is_some() {
        return;
    }
    let what = match reference.children().find(|child| !child.is("userData")) {
        Some(child) => format!("contains `{}` and no text", child.name()),
        None => "is empty".to_owned(),
    };
    let text = format!(
        "`geoReference` {what}; it must name a projection, such as `+proj=utm +zone=32`, or be omitted if the \
         map has no place on Earth"
    );
    found.issue(reference, text);
}

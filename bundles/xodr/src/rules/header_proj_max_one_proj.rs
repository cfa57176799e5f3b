use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.1.0" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let header = map.header().into_iter();
    let mut references = header.flat_map(|header| header.children_named("geoReference"));
    let Some(first) = references.next() else {
        return;
    };
    check_text(first, found);
    for further in references {
        let text = "there is a second `geoReference`; a file must have no more than one projection";
        found.issue(further, text).at(first, "the first one");
        check_text(further, found);
    }
}

/// Reports several projections in a PROJ string. A pipeline is one projection with steps.
fn check_text(reference: Node<'_>, found: &mut Sink<'_>) {
    let text = reference.text();
    let names: Vec<&str> = text
        .split_whitespace()
        .filter_map(|word| word.strip_prefix("+proj="))
        .collect();
    if names.len() > 1 && !names.contains(&"pipeline") {
        let text = format!(
            "`geoReference` names {} projections (`{}`); a file must have no more than one",
            names.len(),
            names.join("`, `")
        );
        found.issue(reference, text);
    }
}

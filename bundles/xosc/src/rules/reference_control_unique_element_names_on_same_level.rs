use crate::families::names;
use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    uids: &[
        "asam.net:xosc:1.2.0:reference_control.unique_element_names_on_same_level",
        "asam.net:xosc:1.0.0:naming.unique_element_names_on_same_level",
        "qcbus.dev:xosc:1.0.0:parameters.duplicate_declaration",
        "qcbus.dev:xosc:1.0.0:variables.duplicate",
        "qcbus.dev:xosc:1.0.0:monitors.duplicate",
    ],
    versions: "1.2.0..",
    readers: Some(names::BY_CASE),
    run,
    ..Rule::after(READABLE)
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    names::unique_among_siblings(document, found);
}

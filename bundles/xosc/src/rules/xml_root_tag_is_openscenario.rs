use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xosc_xml_valid_xml_document"],
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::root_is(document, "OpenSCENARIO", found);
}

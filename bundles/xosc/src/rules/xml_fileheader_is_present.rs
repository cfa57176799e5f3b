use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xosc_xml_root_tag_is_openscenario"],
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::has_header(document, "FileHeader", found);
}

use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xodr_xml_root_tag_is_opendrive"],
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::has_header(document, "header", found);
}

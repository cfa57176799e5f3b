use crate::prelude::*;

pub const RULE: Rule<Document> = Rule {
    after: &["check_asam_xosc_xml_fileheader_is_present"],
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::version_is_defined(document, "FileHeader", found);
}

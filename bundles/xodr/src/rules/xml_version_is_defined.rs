use crate::prelude::*;

pub static RULE: Rule<Document> = Rule {
    id: "check_asam_xodr_xml_version_is_defined",
    uids: &["asam.net:xodr:1.0.0:xml.version_is_defined"],
    after: &["check_asam_xodr_xml_fileheader_is_present"],
    page: include_str!("xml_version_is_defined.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::version_is_defined(document, "header", found);
}

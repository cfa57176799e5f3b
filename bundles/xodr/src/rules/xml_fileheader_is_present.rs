use crate::prelude::*;

pub static RULE: Rule<Document> = Rule {
    id: "check_asam_xodr_xml_fileheader_is_present",
    uids: &["asam.net:xodr:1.0.0:xml.fileheader_is_present"],
    after: &["check_asam_xodr_xml_root_tag_is_opendrive"],
    page: include_str!("xml_fileheader_is_present.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::has_header(document, "header", found);
}

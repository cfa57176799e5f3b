use crate::prelude::*;

pub static RULE: Rule<Document> = Rule {
    id: "check_asam_xodr_xml_root_tag_is_opendrive",
    uids: &["asam.net:xodr:1.0.0:xml.root_tag_is_opendrive"],
    after: &["check_asam_xodr_xml_valid_xml_document"],
    page: include_str!("xml_root_tag_is_opendrive.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::root_is(document, "OpenDRIVE", found);
}

use crate::prelude::*;

pub static RULE: Rule<Document> = Rule {
    id: "check_asam_xosc_xml_root_tag_is_openscenario",
    uids: &["asam.net:xosc:1.0.0:xml.root_tag_is_openscenario"],
    after: &["check_asam_xosc_xml_valid_xml_document"],
    page: include_str!("xml_root_tag_is_openscenario.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::root_is(document, "OpenSCENARIO", found);
}

use crate::prelude::*;

pub static RULE: Rule<Document> = Rule {
    id: "check_asam_xosc_xml_valid_xml_document",
    uids: &["asam.net:xosc:1.0.0:xml.valid_xml_document"],
    page: include_str!("xml_valid_xml_document.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(document: &Document<'_>, found: &mut Sink<'_>) {
    basic::report_faults(document, found);
}

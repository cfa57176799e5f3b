use crate::prelude::*;
use qcbus_schema_rule::Validated;

pub static RULE: Rule<Validated> = Rule {
    id: "check_asam_xodr_xml_valid_schema",
    uids: &["asam.net:xodr:1.0.0:xml.valid_schema"],
    after: &["check_asam_xodr_xml_version_is_defined"],
    page: include_str!("xml_valid_schema.md"),
    ..qcbus_schema_rule::RULE
};

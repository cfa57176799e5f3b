use crate::prelude::*;
use qcbus_schema_rule::Validated;

pub static RULE: Rule<Validated> = Rule {
    id: "check_asam_xosc_xml_valid_schema",
    uids: &[
        "asam.net:xosc:1.0.0:xml.valid_schema",
        "qcbus.dev:xosc:1.0.0:header.version_feature_mismatch",
    ],
    after: &["check_asam_xosc_xml_version_is_defined"],
    page: include_str!("xml_valid_schema.md"),
    ..qcbus_schema_rule::RULE
};

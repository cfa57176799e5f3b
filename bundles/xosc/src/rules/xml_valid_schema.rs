use crate::prelude::*;
use qcbus_schema_rule::Validated;

pub const RULE: Rule<Validated> = Rule {
    uids: &[
        "asam.net:xosc:1.0.0:xml.valid_schema",
        "qcbus.dev:xosc:1.0.0:header.version_feature_mismatch",
    ],
    after: &["check_asam_xosc_xml_version_is_defined"],
    ..qcbus_schema_rule::RULE
};

use crate::prelude::*;
use qcbus_schema_rule::Validated;

pub const RULE: Rule<Validated> = Rule {
    after: &["check_asam_xodr_xml_version_is_defined"],
    ..qcbus_schema_rule::RULE
};

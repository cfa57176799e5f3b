use crate::prelude::*;
use qcbus_schema_rule::Validated;

// Every violation is an error: CARLA's ScenarioRunner validates a scenario against the schema and
// refuses it, and programs with ASAM's OpenSCENARIO API read a file by the version in its header.
pub const RULE: Rule<Validated> = Rule {
    uids: &[
        "asam.net:xosc:1.0.0:xml.valid_schema",
        "qcbus.dev:xosc:1.0.0:header.version_feature_mismatch",
    ],
    after: &["check_asam_xosc_xml_version_is_defined"],
    ..qcbus_schema_rule::RULE
};

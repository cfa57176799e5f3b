use crate::prelude::*;
use qcbus_schema::{Checked, Code, Detail, Violation};
use qcbus_schema_rule::{Harm, Validated, run_with};

pub const RULE: Rule<Validated> = Rule {
    uids: &[
        "asam.net:xosc:1.0.0:xml.valid_schema",
        "qcbus.dev:xosc:1.0.0:header.version_feature_mismatch",
    ],
    after: &["check_asam_xosc_xml_version_is_defined"],
    readers: Some(Readers::by_case(
        "readers pass over the order of children and older headers",
    )),
    run,
    ..qcbus_schema_rule::RULE
};

/// What esmini does with violations, and with versions other than the one that it was written for.
const HARM: Harm = Harm {
    of_violation: harm,
    // Readers decide by what they find, not by the version.
    of_old_header: Level::Warning,
};

fn run(checked: &Checked<'_>, found: &mut Sink<'_>) {
    run_with(checked, found, &HARM);
}

fn harm(violation: &Violation<'_>) -> Level {
    let is_order = violation.code == Code::MisplacedElement || violation.detail == Detail::Later;
    match is_order {
        true => Level::Warning,
        false => Level::Error,
    }
}

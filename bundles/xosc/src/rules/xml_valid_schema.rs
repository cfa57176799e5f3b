use qcbus_schema::{Checked, Severity};
use qcbus_sdk::{Level, Place, Rule, Sink};

use crate::schema::{SCHEMA_DIR, SCHEMAS, Validated};

pub static RULE: Rule<Validated> = Rule {
    id: "check_asam_xosc_xml_valid_schema",
    uids: &["asam.net:xosc:1.0.0:xml.valid_schema"],
    after: &["check_asam_xosc_xml_version_is_defined"],
    params: &[SCHEMA_DIR],
    resource: Some(&SCHEMAS),
    page: include_str!("xml_valid_schema.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(checked: &Checked<'_>, found: &mut Sink<'_>) {
    for fact in checked.provenance() {
        found.fact(fact.key, fact.value, fact.description);
    }
    for finding in &checked.findings {
        let place = match finding.attribute {
            Some(attribute) => Place::from(attribute),
            None => Place::from(finding.node),
        };
        found
            .issue(place, finding.text.as_str())
            .level(level(checked.severity(finding)));
    }
    for rest in &checked.rest {
        let Some(root) = found.subject().root().root() else {
            return;
        };
        let text = format!(
            "{} further findings like these are not listed: {} of `{}`",
            rest.count,
            rest.code.as_str(),
            rest.subject
        );
        found
            .issue(root, text)
            .level(level(checked.severity_of_rest(rest)));
    }
}

fn level(severity: Severity) -> Level {
    match severity {
        Severity::Error => Level::Error,
        Severity::Warning => Level::Warning,
        Severity::Information => Level::Information,
    }
}

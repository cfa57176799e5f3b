use qcbus_openscenario::Scenario;
use qcbus_sdk::{Place, Rule, Sink};

use crate::families::values;
use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_expressions_before_1_1",
    uids: &["qcbus.dev:xosc:1.0.0:expressions.before_1_1"],
    versions: "1.0.0..1.1.0",
    after: super::READABLE,
    page: include_str!("expressions_before_1_1.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let mut expressions = scenario.written_expressions();
    let Some(first) = expressions.next() else {
        return;
    };
    let others = expressions.count();
    let rest = match others {
        0 => String::new(),
        1 => ", and there is one more".to_owned(),
        _ => format!(", and there are {others} more"),
    };
    let text = format!(
        "{}: the file is of version 1.0, which has no expressions; they came with 1.1{rest}",
        values::written(first)
    );
    let finding = found.issue(first, text);
    if let Some(header) = scenario.root().child("FileHeader") {
        finding.at(
            Place::attribute_or_node(header.node(), "revMinor"),
            "the version",
        );
    }
}

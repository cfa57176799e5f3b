use crate::families::values;
use crate::prelude::*;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_expressions_precision_loss",
    uids: &["qcbus.dev:xosc:1.0.0:expressions.precision_loss"],
    level: Level::Information,
    versions: "1.1.0..",
    after: super::READABLE,
    page: include_str!("expressions_precision_loss.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (attribute, evaluated) in scenario.expressions() {
        if let Some(lost) = evaluated.imprecise {
            let text = format!(
                "{}: digits are lost; {}",
                values::written(attribute),
                lost.text
            );
            found.issue(attribute, text);
        }
    }
}

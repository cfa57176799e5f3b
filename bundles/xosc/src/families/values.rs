//! Values that cannot be had as they are written: the model lists them once, each rule says its kinds.

use qcbus_document::Attribute;
use qcbus_openscenario::{Scenario, ValueFault, ValueFaultKind};
use qcbus_sdk::{Finding, Sink};

/// Says every fault of these kinds.
pub(crate) fn report(scenario: &Scenario<'_>, kinds: &[ValueFaultKind], found: &mut Sink<'_>) {
    for fault in scenario.faults_of(kinds) {
        say(fault, found);
    }
}

/// Says one fault.
pub(crate) fn say<'s, 'd>(fault: &ValueFault<'_>, found: &'s mut Sink<'d>) -> Finding<'s, 'd> {
    found.issue(
        fault.attribute,
        format!("{}: {}", written(fault.attribute), fault.text),
    )
}

/// The attribute as it is written, for the beginning of a text.
pub(crate) fn written(attribute: Attribute<'_>) -> String {
    format!(
        "`{}=\"{}\"` of `{}`",
        attribute.name(),
        short(attribute.value()),
        attribute.node().name()
    )
}

/// A value, cut where nobody reads on.
pub(crate) fn short(value: &str) -> String {
    const MOST: usize = 80;
    match value.char_indices().nth(MOST) {
        Some((end, _)) => format!("{}…", &value[..end]),
        None => value.to_owned(),
    }
}

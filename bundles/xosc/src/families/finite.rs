//! Numbers that must be neither infinite nor `NaN`. The schema accepts both as doubles.

use crate::families::references::quoted;
use crate::prelude::*;

/// Elements with the attributes that must be finite numbers.
pub(crate) type Numbers = [(&'static str, &'static [&'static str])];

/// Reports the numbers that are not finite, and why they must be.
pub(crate) fn report(scenario: &Scenario<'_>, numbers: &Numbers, why: &str, found: &mut Sink<'_>) {
    for (name, attributes) in numbers {
        for element in scenario.elements_everywhere(name) {
            for attribute in *attributes {
                let Some(value) = element.double(attribute).filter(|value| !value.is_finite())
                else {
                    continue;
                };
                let shown = if value.is_nan() {
                    "NaN"
                } else if value > 0.0 {
                    "INF"
                } else {
                    "-INF"
                };
                let shown = quoted(element, attribute, shown);
                let text = format!("`{attribute}` of `{name}` is {shown}; {why}");
                found.about(element, attribute, text);
            }
        }
    }
}

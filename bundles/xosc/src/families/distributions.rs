//! Distributions of parameter values, and their target scenario.

use crate::prelude::*;
use qcbus_document::FileKind;
use qcbus_messages::DocumentRole;
use qcbus_openscenario::Inputs;
use qcbus_openscenario::LinkedMap;
use qcbus_sdk::Subject;

/// Elements that give values to a parameter, and the attribute with the parameter's name.
pub(crate) const SOURCES: &[(&str, &str)] = &[
    ("DeterministicSingleParameterDistribution", "parameterName"),
    ("StochasticDistribution", "parameterName"),
    ("ParameterAssignment", "parameterRef"),
];

/// Returns the target scenario of a distribution, built for its parameters only. Returns `None` if
/// it is missing or no scenario.
pub(crate) fn target<'d>(
    scenario: &Scenario<'_>,
    subject: &'d Subject<'d>,
) -> Option<Scenario<'d>> {
    Scenario::new(&inputs(scenario, subject)?)
}

/// Returns the inputs of the target scenario of a distribution.
pub(crate) fn inputs<'d>(scenario: &Scenario<'_>, subject: &'d Subject<'d>) -> Option<Inputs<'d>> {
    if scenario.form() != Form::Distribution {
        return None;
    }
    let linked = subject.with_role(DocumentRole::Scenario).next()?;
    if Form::of(&linked.document) != Form::Scenario {
        return None;
    }
    let header = linked.document.root()?.child("FileHeader");
    let part = |name| header?.attr(name)?.trim().parse::<u16>().ok();
    Some(Inputs {
        document: linked.document,
        kind: FileKind::Xosc,
        version: part("revMajor").zip(part("revMinor")),
        map: LinkedMap::Unnamed,
        catalogs: Vec::new(),
        incomplete: Vec::new(),
    })
}

/// Returns the name of a parameter, without a superfluous `$`.
pub(crate) fn parameter_name<'d>(source: Element<'_, 'd>, attribute: &str) -> Option<&'d str> {
    source.written(attribute).map(bare)
}

/// Returns the declaration of a parameter by a scenario itself.
pub(crate) fn declaration<'m, 'd>(
    target: &'m Scenario<'d>,
    name: &str,
) -> Option<&'m Declaration<'d>> {
    target.root().declaration(name)
}

/// Returns the lower and upper limit of a range.
pub(crate) fn limits(range: Element<'_, '_>) -> Option<(f64, f64)> {
    range.number("lowerLimit").zip(range.number("upperLimit"))
}

/// Returns the number of values of a range with steps. The last value counts if it is reached
/// within rounding.
pub(crate) fn steps(distribution: Element<'_, '_>) -> Option<f64> {
    let (lower, upper) = limits(distribution.child("Range")?)?;
    let step = distribution.number("stepWidth")?;
    (step > 0.0 && upper >= lower).then(|| ((upper - lower) / step + 1e-9).floor() + 1.0)
}

/// Checks whether values of the type are whole numbers.
pub(crate) fn is_whole(data_type: DataType) -> bool {
    data_type.range().is_some()
}

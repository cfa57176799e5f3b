//! Distributions of parameter values, and the scenario that they are for.

use qcbus_document::FileKind;
use qcbus_messages::DocumentRole;
use qcbus_openscenario::{DataType, Declaration, Element, Form, Inputs, LinkedMap, Scenario};
use qcbus_sdk::Subject;

/// What gives values to a parameter, and the attribute that names it.
pub(crate) const SOURCES: &[(&str, &str)] = &[
    ("DeterministicSingleParameterDistribution", "parameterName"),
    ("StochasticDistribution", "parameterName"),
    ("ParameterAssignment", "parameterRef"),
];

/// The scenario that a distribution is for, as far as its parameters go; `None` when it is not there,
/// or is no scenario.
pub(crate) fn target<'d>(
    scenario: &Scenario<'_>,
    subject: &'d Subject<'d>,
) -> Option<Scenario<'d>> {
    Scenario::new(&inputs(scenario, subject)?)
}

/// What the scenario that a distribution is for is read from.
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

/// The name of a parameter, without the `$` that does not belong there.
pub(crate) fn parameter_name<'d>(source: Element<'_, 'd>, attribute: &str) -> Option<&'d str> {
    let written = source.written(attribute)?;
    Some(written.strip_prefix('$').unwrap_or(written))
}

/// The declaration of a parameter by a scenario itself.
pub(crate) fn declaration<'m, 'd>(
    target: &'m Scenario<'d>,
    name: &str,
) -> Option<&'m Declaration<'d>> {
    let mut own = target.root().declarations().iter();
    own.find(|one| one.name == name)
}

/// Lower and upper limit of a range.
pub(crate) fn limits(range: Element<'_, '_>) -> Option<(f64, f64)> {
    range.number("lowerLimit").zip(range.number("upperLimit"))
}

/// How many values a range with steps has; the last is counted when it is met up to rounding.
pub(crate) fn steps(distribution: Element<'_, '_>) -> Option<f64> {
    let (lower, upper) = limits(distribution.child("Range")?)?;
    let step = distribution.number("stepWidth")?;
    (step > 0.0 && upper >= lower).then(|| ((upper - lower) / step + 1e-9).floor() + 1.0)
}

/// Whether values of the type are whole numbers.
pub(crate) fn is_whole(data_type: DataType) -> bool {
    data_type.range().is_some()
}

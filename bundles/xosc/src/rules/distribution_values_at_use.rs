use crate::families::distributions;
use crate::families::references::{entity_references, hint};
use crate::families::{allowed_values, ranges, values};
use crate::prelude::*;
use foldhash::{HashMap, HashSet};
use qcbus_openscenario::Inputs;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

/// Maximum number of elements that are read again in total. Large scenarios are checked with fewer
/// values.
const BUDGET: usize = 2_000_000;

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(inputs) = distributions::inputs(scenario, found.subject()) else {
        return;
    };
    let Some(target) = Scenario::new(&inputs) else {
        return;
    };
    let draws = draws(scenario, &target);
    let trial = Trial::of(&inputs, &target, &draws);
    let most = BUDGET / (1 + target.root().descendants().count());
    for draw in draws.iter().take(most.max(1)) {
        trial.with(draw, found);
    }
}

/// Values of one run: one value of a distribution, or a set.
struct Draw<'m, 'd, 't> {
    /// Place of the report, if it is about more than one value.
    holder: Element<'m, 'd>,
    values: Vec<Drawn<'m, 'd, 't>>,
}

/// The value of one parameter.
struct Drawn<'m, 'd, 't> {
    name: &'t str,
    value: Value<'t>,
    source: Element<'m, 'd>,
    attribute: &'static str,
}

/// Returns all values that are certain to be drawn and that are allowed.
fn draws<'m, 'd, 't>(scenario: &'m Scenario<'d>, target: &Scenario<'t>) -> Vec<Draw<'m, 'd, 't>> {
    let mut draws = Vec::new();
    for name in [
        "DeterministicSingleParameterDistribution",
        "StochasticDistribution",
    ] {
        for source in scenario.elements(name) {
            let Some(name) = distributions::parameter_name(source, "parameterName") else {
                continue;
            };
            let sets = source
                .children()
                .filter(|set| set.name().ends_with("DistributionSet"));
            for element in sets.flat_map(|set| set.children_named("Element")) {
                let values: Vec<_> = drawn(target, name, element).into_iter().collect();
                let holder = element;
                draws.push(Draw { holder, values });
            }
            if let Some(distribution) = source.child("DistributionRange") {
                draws.extend(ends(target, name, distribution));
            }
        }
    }
    for set in scenario.elements("ParameterValueSet") {
        let values = set
            .children_named("ParameterAssignment")
            .filter_map(|assignment| {
                let name = distributions::parameter_name(assignment, "parameterRef")?;
                drawn(target, name, assignment)
            });
        draws.push(Draw {
            holder: set,
            values: values.collect(),
        });
    }
    draws.retain(|draw| !draw.values.is_empty());
    draws
}

/// Returns a value of a parameter, unless another rule reports it as faulty.
fn drawn<'m, 'd, 't>(
    target: &Scenario<'t>,
    name: &str,
    source: Element<'m, 'd>,
) -> Option<Drawn<'m, 'd, 't>> {
    let declaration = distributions::declaration(target, name)?;
    let text = source.text("value").filter(|text| !text.contains('$'))?;
    let value = declaration.data_type?.parse(&text)?;
    if allowed_values::violated(target.element(declaration.node), &value).is_some() {
        return None;
    }
    let value = owned(value);
    Some(Drawn {
        name: declaration.name,
        value,
        source,
        attribute: "value",
    })
}

/// Returns the first and the last value of a range with steps.
fn ends<'m, 'd, 't>(
    target: &Scenario<'t>,
    name: &str,
    distribution: Element<'m, 'd>,
) -> Vec<Draw<'m, 'd, 't>> {
    let declaration = distributions::declaration(target, name);
    let declaration = declaration.filter(|one| one.data_type.is_some_and(|it| it.is_numeric()));
    let range = distribution.child("Range");
    let first = range.and_then(|range| range.number("lowerLimit"));
    let count = distributions::steps(distribution);
    let step = distribution.number("stepWidth");
    let (Some(declaration), Some(range), Some(first), Some(count), Some(step)) =
        (declaration, range, first, count, step)
    else {
        return Vec::new();
    };
    let last = first + (count - 1.0) * step;
    let both = [("lowerLimit", first), ("upperLimit", last)].into_iter();
    let both = both.filter_map(|(attribute, number)| {
        let text = number.to_string();
        let value = declaration.data_type?.parse(&text)?;
        let is_allowed =
            allowed_values::violated(target.element(declaration.node), &value).is_none();
        let value = is_allowed.then(|| owned(value))?;
        let one = Drawn {
            name: declaration.name,
            value,
            source: range,
            attribute,
        };
        Some(Draw {
            holder: range,
            values: vec![one],
        })
    });
    both.collect()
}

/// Converts a value to one without borrows.
fn owned<'t>(value: Value<'_>) -> Value<'t> {
    match value {
        Value::Text(text) => Value::Text(text.into_owned().into()),
        Value::Integer(value) => Value::Integer(value),
        Value::Double(value) => Value::Double(value),
        Value::Boolean(value) => Value::Boolean(value),
    }
}

/// A trial of the scenario with other values.
struct Trial<'s, 't> {
    inputs: &'s Inputs<'t>,
    target: &'s Scenario<'t>,
    /// Offsets of the faults of the scenario with its own values.
    before: HashSet<u32>,
    /// Parameters that occur in an attribute, by its offset.
    uses: HashMap<u32, Vec<&'t str>>,
    /// All parameters that are drawn.
    drawn: HashSet<&'t str>,
}

impl<'s, 't> Trial<'s, 't> {
    fn of(
        inputs: &'s Inputs<'t>,
        target: &'s Scenario<'t>,
        draws: &[Draw<'_, '_, 't>],
    ) -> Trial<'s, 't> {
        let mut uses: HashMap<u32, Vec<&'t str>> = HashMap::default();
        for (attribute, name) in target.parameter_uses() {
            uses.entry(attribute.offset()).or_default().push(name);
        }
        let values = draws.iter().flat_map(|draw| &draw.values);
        Trial {
            inputs,
            target,
            before: problems(target)
                .into_iter()
                .map(|(attribute, _)| attribute.offset())
                .collect(),
            uses,
            drawn: values.map(|value| value.name).collect(),
        }
    }

    /// Reports faults that occur only with the values of a draw.
    fn with(&self, draw: &Draw<'_, '_, 't>, found: &mut Sink<'_>) {
        let values: HashMap<&'t str, Declared<'t>> = draw
            .values
            .iter()
            .map(|one| (one.name, Declared::Value(one.value.clone())))
            .collect();
        let Some(scenario) = Scenario::with_values(self.inputs, &values) else {
            return;
        };
        let mut new = problems(&scenario)
            .into_iter()
            .filter(|(attribute, _)| !self.before.contains(&attribute.offset()))
            .filter_map(|(attribute, text)| {
                let behind = self.behind(attribute);
                // With the values of other distributions the place may be correct.
                let is_own = behind.iter().all(|name| values.contains_key(name));
                (is_own && !behind.is_empty()).then_some((attribute, text, behind))
            });
        let Some((attribute, text, behind)) = new.next() else {
            return;
        };
        let more = match new.count() {
            0 => String::new(),
            1 => "; it breaks one more place".to_owned(),
            more => format!("; it breaks {more} more places"),
        };
        let own: Vec<_> = draw
            .values
            .iter()
            .filter(|one| behind.contains(one.name))
            .collect();
        let shown: Vec<String> = own
            .iter()
            .map(|one| format!("`{}` of `{}`", values::short(&one.value.text()), one.name))
            .collect();
        let place = match own.as_slice() {
            [one] => Place::attribute_or_node(one.source.node(), one.attribute),
            _ => draw.holder.node().into(),
        };
        let text = format!(
            "with the value {} the scenario is invalid: {text}{more}",
            shown.join(" and ")
        );
        found
            .issue(place, text)
            .at(attribute, "the place where it is used");
    }

    /// Returns the drawn parameters that the value of an attribute depends on.
    fn behind(&self, attribute: Attribute<'t>) -> HashSet<&'t str> {
        let mut seen: HashSet<&'t str> = HashSet::default();
        let mut open = vec![attribute.offset()];
        while let Some(offset) = open.pop() {
            for name in self.uses.get(&offset).into_iter().flatten() {
                if !seen.insert(name) {
                    continue;
                }
                let declaration = distributions::declaration(self.target, name);
                let value = declaration.and_then(|one| one.node.attribute("value"));
                // A drawn value does not depend on the declared one.
                if !self.drawn.contains(name) {
                    open.extend(value.map(|value| value.offset()));
                }
            }
        }
        seen.retain(|name| self.drawn.contains(name));
        seen
    }
}

/// Returns the faults that break the scenario: values that do not fit their use, numbers out of
/// range, and unknown names of entities.
fn problems<'t>(scenario: &Scenario<'t>) -> Vec<(Attribute<'t>, String)> {
    const KINDS: &[ValueFaultKind] = &[
        ValueFaultKind::Evaluation,
        ValueFaultKind::Result,
        ValueFaultKind::Parameter,
        ValueFaultKind::Word,
        ValueFaultKind::Declared,
    ];
    let faults = values::faults(scenario, KINDS);
    let mut problems: Vec<_> = faults
        .map(|fault| {
            let text = format!("{}: {}", values::written(fault.attribute), fault.text);
            (fault.attribute, text)
        })
        .collect();
    for (element, attribute, text) in ranges::broken(scenario) {
        problems.extend(element.attribute(attribute).map(|it| (it, text)));
    }
    let entities = scenario.entities();
    for (name, attribute) in entity_references() {
        for reference in scenario.elements(name) {
            let text = reference.text(attribute);
            let named = reference.attribute(attribute).zip(text);
            let Some((at, name)) = named.filter(|(_, name)| !entities.contains(name)) else {
                continue;
            };
            let text = format!(
                "`{}` refers to the entity `{name}`, which does not exist{}",
                reference.name(),
                hint(&name, entities.names())
            );
            problems.push((at, text));
        }
    }
    problems.sort_by_key(|(attribute, _)| attribute.offset());
    problems.dedup_by_key(|(attribute, _)| attribute.offset());
    problems
}

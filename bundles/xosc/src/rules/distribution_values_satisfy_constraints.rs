use crate::families::distributions::{self, SOURCES};
use crate::families::{allowed_values, references::quoted};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(target) = distributions::target(scenario, found.subject()) else {
        return;
    };
    for (element, attribute) in SOURCES {
        for source in scenario.elements(element) {
            let name = distributions::parameter_name(source, attribute);
            let declaration = name.and_then(|name| distributions::declaration(&target, name));
            let Some((declaration, data_type)) =
                declaration.and_then(|one| Some((one, one.data_type?)))
            else {
                continue;
            };
            let mut draw = Draw {
                target: &target,
                declaration,
                data_type,
            };
            if source.is("ParameterAssignment") {
                draw.value(source, found);
            }
            for set in ["DistributionSet", "ProbabilityDistributionSet"] {
                let set = source.child(set).into_iter();
                for one in set.flat_map(|set| set.children_named("Element")) {
                    draw.value(one, found);
                }
            }
            draw.numbers(source, found);
        }
    }
}

/// A parameter of the scenario that gets values.
struct Draw<'t, 'd> {
    target: &'t Scenario<'d>,
    declaration: &'t Declaration<'d>,
    data_type: DataType,
}

impl Draw<'_, '_> {
    /// Checks one literal value.
    fn value(&mut self, holder: Element<'_, '_>, found: &mut Sink<'_>) {
        // Values that are no literals are not computed here.
        let Some(text) = holder.text("value").filter(|text| !text.contains('$')) else {
            return;
        };
        let name = self.declaration.name;
        match self.data_type.parse(&text) {
            None => {
                let text = format!(
                    "`{name}` gets the value {}, but is of type `{}`, which is {}",
                    quoted(holder, "value", &text),
                    self.data_type.word(),
                    self.data_type.allowed()
                );
                found
                    .about(holder, "value", text)
                    .at(self.declaration.node, "the declaration");
            }
            Some(value) => self.allowed((holder, "value"), &value, Level::Error, found),
        }
    }

    fn allowed(
        &self,
        (holder, attribute): (Element<'_, '_>, &str),
        value: &Value<'_>,
        level: Level,
        found: &mut Sink<'_>,
    ) {
        let declaration = self.target.element(self.declaration.node);
        if let Some(allowed) = allowed_values::violated(declaration, value) {
            let text = format!(
                "`{}` gets the value `{}`, but the scenario allows only {allowed}",
                self.declaration.name,
                value.text()
            );
            found
                .about(holder, attribute, text)
                .level(level)
                .at(self.declaration.node, "the declaration");
        }
    }

    /// Checks distributions of numbers.
    fn numbers(&self, source: Element<'_, '_>, found: &mut Sink<'_>) {
        const NUMBERS: [&str; 6] = [
            "DistributionRange",
            "UniformDistribution",
            "NormalDistribution",
            "LogNormalDistribution",
            "PoissonDistribution",
            "Histogram",
        ];
        let mut all = source
            .children()
            .filter(|child| NUMBERS.contains(&child.name()));
        let Some(distribution) = all.next() else {
            return;
        };
        if !self.data_type.is_numeric() {
            let text = format!(
                "`{}` is of type `{}`, but a `{}` produces numbers",
                self.declaration.name,
                self.data_type.word(),
                distribution.name()
            );
            found
                .issue(distribution.node(), text)
                .at(self.declaration.node, "the declaration");
        } else if distribution.is("DistributionRange") {
            self.range(distribution, found);
        } else {
            self.ends(distribution, found);
        }
    }

    /// Checks the first and the last value of a range with steps, and whether all values are whole.
    fn range(&self, distribution: Element<'_, '_>, found: &mut Sink<'_>) {
        let range = distribution.child("Range");
        let lower = range.and_then(|range| range.number("lowerLimit"));
        let (Some(range), Some(lower), Some(count)) =
            (range, lower, distributions::steps(distribution))
        else {
            return;
        };
        let step = distribution.number("stepWidth").unwrap_or(0.0);
        let last = lower + (count - 1.0) * step;
        let broken = lower.fract() != 0.0 || (count > 1.0 && step.fract() != 0.0);
        if distributions::is_whole(self.data_type) && broken {
            let text = format!(
                "`{}` is of type `{}`, which is {}, but the range goes from {lower} in steps of {step}",
                self.declaration.name,
                self.data_type.word(),
                self.data_type.allowed()
            );
            found
                .issue(distribution.node(), text)
                .at(self.declaration.node, "the declaration");
            return;
        }
        let ends = [("lowerLimit", lower), ("upperLimit", last)];
        let ends = ends.into_iter().take(1 + usize::from(last > lower));
        let declaration = self.target.element(self.declaration.node);
        let is_allowed =
            |value: f64| allowed_values::violated(declaration, &Value::Double(value)).is_none();
        // Generators drop values that the scenario excludes. If one of the ends is allowed, some
        // runs remain.
        let level = if ends.clone().any(|(_, end)| is_allowed(end)) {
            Level::Warning
        } else {
            Level::Error
        };
        for (attribute, end) in ends {
            self.allowed((range, attribute), &Value::Double(end), level, found);
        }
    }

    /// Checks the possible values of a draw: the ends of the range that limits it.
    fn ends(&self, distribution: Element<'_, '_>, found: &mut Sink<'_>) {
        let own = distribution.child("Range").into_iter();
        let bins = distribution
            .children_named("Bin")
            .filter_map(|bin| bin.child("Range"));
        let declaration = self.target.element(self.declaration.node);
        for range in own.chain(bins) {
            let Some((lower, upper)) = distributions::limits(range) else {
                continue;
            };
            let middle = Value::Double((lower + upper) / 2.0);
            for (attribute, limit) in [("lowerLimit", lower), ("upperLimit", upper)] {
                let limit = Value::Double(limit);
                // The exact ends are hardly ever drawn, so an open bound may equal them.
                let near = Value::Double(match (limit.number(), middle.number()) {
                    (Some(limit), Some(middle)) => limit + (middle - limit) * 1e-6,
                    _ => continue,
                });
                let Some(allowed) = allowed_values::violated(declaration, &near) else {
                    continue;
                };
                let text = format!(
                    "`{}` may get values near `{}`, but the scenario allows only {allowed}",
                    self.declaration.name,
                    limit.text()
                );
                found
                    .about(range, attribute, text)
                    .level(Level::Warning)
                    .at(self.declaration.node, "the declaration");
            }
        }
    }
}

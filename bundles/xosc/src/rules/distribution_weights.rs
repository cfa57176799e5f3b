use crate::families::references::quoted;
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

/// Attributes of the shape of a distribution: element, attribute, allowed values in words, and
/// whether 0 is allowed.
const SHAPES: &[(&str, &str, &str, bool)] = &[
    ("NormalDistribution", "variance", "0 or more", true),
    ("LogNormalDistribution", "variance", "0 or more", true),
    ("PoissonDistribution", "expectedValue", "above 0", false),
    ("Stochastic", "numberOfTestRuns", "1 or more", false),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (element, attribute, allowed, zero) in SHAPES {
        for one in scenario.elements(element) {
            let value = one.number(attribute);
            if let Some(value) = value.filter(|value| *value < 0.0 || (*value == 0.0 && !zero)) {
                let text = format!(
                    "`{attribute}` of `{element}` is {}, but must be {allowed}",
                    quoted(one, attribute, &value.to_string())
                );
                found.about(one, attribute, text);
            } else if value == Some(0.0) {
                let text = format!(
                    "`{attribute}` of `{element}` is 0, so all values are equal; check whether a distribution is \
                     intended"
                );
                found.about(one, attribute, text).level(Level::Warning);
            }
        }
    }
    for (set, part) in [
        ("ProbabilityDistributionSet", "Element"),
        ("Histogram", "Bin"),
    ] {
        for set in scenario.elements(set) {
            weights(set, part, found);
        }
    }
}

fn weights(set: Element<'_, '_>, part: &str, found: &mut Sink<'_>) {
    let mut sum = Some(0.0);
    let mut negative = false;
    for one in set.children_named(part) {
        let weight = one.number("weight");
        sum = sum.zip(weight).map(|(sum, weight)| sum + weight);
        if let Some(weight) = weight.filter(|weight| *weight < 0.0) {
            negative = true;
            let text = format!(
                "the weight is {}, but must not be negative; it defines how often the value is drawn",
                quoted(one, "weight", &weight.to_string())
            );
            found.about(one, "weight", text);
        }
    }
    if sum == Some(0.0) && !negative && set.child(part).is_some() {
        let text =
            "all weights are 0, so no value can be drawn; at least one must be greater than 0";
        found.issue(set.node(), text);
    }
}

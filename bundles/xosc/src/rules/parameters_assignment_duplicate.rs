use foldhash::HashMap;
use qcbus_openscenario::{Element, Scenario};
use qcbus_sdk::{Level, Place, Rule, Sink};

use crate::model::Scene;

pub static RULE: Rule<Scene> = Rule {
    id: "check_qcbus_xosc_parameters_assignment_duplicate",
    uids: &["qcbus.dev:xosc:1.0.0:parameters.assignment_duplicate"],
    after: super::READABLE,
    page: include_str!("parameters_assignment_duplicate.md"),
    run,
    ..Rule::DEFAULTS
};

/// Where assignments stand, what stands there, and the attribute that names the parameter.
const HOLDERS: &[(&str, &[&str], &str)] = &[
    (
        "ParameterAssignments",
        &["ParameterAssignment"],
        "parameterRef",
    ),
    (
        "ParameterValueSet",
        &["ParameterAssignment"],
        "parameterRef",
    ),
    (
        "Deterministic",
        &["DeterministicSingleParameterDistribution"],
        "parameterName",
    ),
    ("Stochastic", &["StochasticDistribution"], "parameterName"),
];

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for (holder, children, attribute) in HOLDERS {
        for block in scenario.elements(holder) {
            let children = block
                .children()
                .filter(|child| children.contains(&child.name()));
            within(block, children, attribute, found);
        }
    }
}

fn within<'m, 'd: 'm>(
    block: Element<'m, 'd>,
    children: impl Iterator<Item = Element<'m, 'd>>,
    attribute: &str,
    found: &mut Sink<'_>,
) {
    let mut first: HashMap<&str, Element<'_, '_>> = HashMap::default();
    for child in children {
        let Some(written) = child.written(attribute) else {
            continue;
        };
        let name = written.strip_prefix('$').unwrap_or(written);
        let Some(known) = first.get(name) else {
            first.insert(name, child);
            continue;
        };
        let same = child.has("value") && child.written("value") == known.written("value");
        let (level, which) = if same {
            (Level::Warning, "the same value twice")
        } else {
            (
                Level::Error,
                "which of the values holds is up to the simulator",
            )
        };
        let text = format!(
            "the parameter `{name}` already has a value in this `{}`: {which}",
            block.name()
        );
        found
            .issue(Place::attribute_or_node(child.node(), attribute), text)
            .level(level)
            .at(known.node(), "its first value");
    }
}

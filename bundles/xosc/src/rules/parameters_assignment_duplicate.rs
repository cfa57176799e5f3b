use crate::prelude::*;
use foldhash::{HashMap, HashSet};

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

/// Holders of assignments, the assigning elements, and the attribute that names the parameter.
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
    for block in scenario.elements("Deterministic") {
        across(block, found);
    }
}

/// Reports distributions of one `Deterministic` that set a parameter which another one already
/// sets. At least one of the two sets it by sets of values.
fn across(block: Element<'_, '_>, found: &mut Sink<'_>) {
    let mut first: HashMap<&str, Element<'_, '_>> = HashMap::default();
    for distribution in block.children() {
        let is_multi = distribution.is("DeterministicMultiParameterDistribution");
        let sources: Vec<_> = if is_multi {
            let all = distribution.descendants_named("ParameterAssignment");
            all.filter_map(|one| Some((one, "parameterRef", one.written("parameterRef")?)))
                .collect()
        } else {
            let name = distribution.written("parameterName");
            name.map(|name| (distribution, "parameterName", name))
                .into_iter()
                .collect()
        };
        let mut said: HashSet<&str> = HashSet::default();
        for (source, attribute, name) in sources {
            let name = bare(name);
            let other = *first.entry(name).or_insert(distribution);
            if other == distribution || !said.insert(name) {
                continue;
            }
            // The other check reports two single distributions.
            if !is_multi && !other.is("DeterministicMultiParameterDistribution") {
                continue;
            }
            let text = format!(
                "the parameter `{name}` already has its values from another distribution of this \
                 `Deterministic`; which of them are used depends on the simulator"
            );
            found
                .issue(Place::attribute_or_node(source.node(), attribute), text)
                .at(other.node(), "the other distribution");
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
        let name = bare(written);
        let Some(known) = first.get(name) else {
            first.insert(name, child);
            continue;
        };
        let same = child.has("value") && child.written("value") == known.written("value");
        let (level, which) = if same {
            (Level::Warning, "both values are the same")
        } else {
            (Level::Error, "which one is used depends on the simulator")
        };
        let text = format!(
            "the parameter `{name}` already has a value in this `{}`; {which}",
            block.name()
        );
        found
            .issue(Place::attribute_or_node(child.node(), attribute), text)
            .level(level)
            .at(known.node(), "its first value");
    }
}

use crate::families::demands::{self, Demand};
use crate::families::timeline;
use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    versions: "1.0.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for group in scenario.elements_everywhere("ConditionGroup") {
        let conditions: Vec<_> = group.children_named("Condition").collect();
        if conditions.len() < 2 {
            continue;
        }
        let mut known: HashMap<String, Demand<'_, '_>> = HashMap::new();
        for condition in conditions {
            let Some((quantity, claim)) = demands::of(condition) else {
                continue;
            };
            // A run that never ends is reported as such.
            if timeline::keeps_running(scenario, condition) {
                continue;
            }
            match known.get_mut(&quantity) {
                None => {
                    known.insert(quantity, claim);
                }
                Some(other) => {
                    if let (Some(against), Some(element)) = (other.against(&claim), claim.element())
                    {
                        let text = format!(
                            "this `{}` requires {}, another condition of the same group {}; all conditions of a \
                             group must be true at once, so this group is never true",
                            element.name(),
                            claim.wanted(),
                            against.wanted
                        );
                        found
                            .about(element, claim.attribute(), text)
                            .at(against.element.node(), "the condition that it contradicts")
                            .maybe_fault(timeline::start_of(element));
                    }
                    other.narrow(claim);
                }
            }
        }
    }
}

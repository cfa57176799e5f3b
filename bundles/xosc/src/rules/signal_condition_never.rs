use crate::families::timeline;
use std::collections::BTreeSet;

use crate::families::positions::listed;
use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    let Some(states) = states(scenario) else {
        return;
    };
    for condition in scenario.elements_everywhere("TrafficSignalCondition") {
        let (Some(signal), Some(state)) = (condition.text("name"), condition.text("state")) else {
            continue;
        };
        let Some(shown) = states.get(&*signal) else {
            continue;
        };
        if shown.contains(state.trim()) {
            continue;
        }
        let text = format!(
            "the condition waits for the state {} of the signal `{signal}`, but its phases set it only to {}; \
             unless the simulator does otherwise, the condition is never true",
            quoted(condition, "state", &state),
            listed(shown.iter().map(String::as_str))
        );
        found
            .about(condition, "state", text)
            .maybe_fault(timeline::start_of(condition));
    }
}

/// Returns the states that the scenario gives to each signal that is in a phase. Returns `None` if
/// they are unknown.
fn states(scenario: &Scenario<'_>) -> Option<HashMap<String, BTreeSet<String>>> {
    if !scenario.storyboard().is_complete() {
        return None;
    }
    // Only the controllers of the road network define the signals of a group.
    if scenario
        .elements_everywhere("TrafficSignalGroupState")
        .next()
        .is_some()
    {
        return None;
    }
    let mut states: HashMap<String, BTreeSet<String>> = HashMap::default();
    for state in scenario.elements_everywhere("TrafficSignalState") {
        let signal = state.text("trafficSignalId")?;
        let own = states.entry(signal.into_owned()).or_default();
        own.insert(trimmed(state)?);
    }
    for action in scenario.elements_everywhere("TrafficSignalStateAction") {
        let signal = action.text("name")?;
        // Without a phase the simulator chooses the first state.
        if let Some(own) = states.get_mut(&*signal) {
            own.insert(trimmed(action)?);
        }
    }
    Some(states)
}

fn trimmed(element: Element<'_, '_>) -> Option<String> {
    Some(element.text("state")?.trim().to_owned())
}

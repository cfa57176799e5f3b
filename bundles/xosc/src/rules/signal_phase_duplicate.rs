use crate::families::references::quoted;
use crate::prelude::*;
use foldhash::HashMap;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for phase in scenario.elements_everywhere("Phase") {
        let mut known: HashMap<String, Element<'_, '_>> = HashMap::default();
        for state in phase.children_named("TrafficSignalState") {
            let Some(signal) = state.text("trafficSignalId") else {
                continue;
            };
            let Some(first) = known.get(&*signal).copied() else {
                known.insert(signal.into_owned(), state);
                continue;
            };
            let (one, other) = (first.text("state"), state.text("state"));
            let Some((one, other)) = one.zip(other) else {
                continue;
            };
            let signal = quoted(state, "trafficSignalId", &signal);
            let (level, text) = if one == other {
                let text = format!("the phase sets the signal {signal} to the same state twice");
                (Level::Information, text)
            } else {
                let text = format!(
                    "the phase sets the signal {signal} to `{other}` and to `{one}` before; which of them it \
                     shows, or whether it shows both, depends on the simulator"
                );
                (Level::Warning, text)
            };
            found
                .about(state, "trafficSignalId", text)
                .level(level)
                .at(first.node(), "its first state");
        }
    }
}

use crate::families::references;
use crate::prelude::*;
use foldhash::HashSet;

pub const RULE: Rule<Scene> = Rule {
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if !scenario.storyboard().is_complete() {
        return;
    }
    let mut started = HashSet::default();
    let mut stops = Vec::new();
    for action in scenario.elements_everywhere("TrafficAction") {
        if action.child("TrafficStopAction").is_some() {
            stops.push(action);
        } else if action.has("trafficName") {
            // An unknown name may be any name.
            let Some(name) = action.text("trafficName") else {
                return;
            };
            started.insert(name.into_owned());
        }
    }
    for stop in stops {
        let Some(name) = stop.text("trafficName") else {
            continue;
        };
        if !started.contains(&*name) {
            let mut names: Vec<&str> = started.iter().map(String::as_str).collect();
            names.sort_unstable();
            let names = names.into_iter();
            references::unresolved(stop, "trafficName", &name, "started traffic", names, found);
        }
    }
}

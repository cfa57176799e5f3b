use crate::families::road_network::{ON_ROADS, ON_SIGNALS, used};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario || !matches!(scenario.network(), Network::Unnamed) {
        return;
    }
    // An empty path is reported where files are looked up. The schema reports a missing
    // `RoadNetwork`.
    let Some(network) = scenario.root().child("RoadNetwork") else {
        return;
    };
    let is_named = ["LogicFile", "Logics"]
        .iter()
        .any(|name| network.child(name).is_some());
    // Elements that need a road network are reported as an error by another rule.
    let is_missed = [ON_ROADS, ON_SIGNALS]
        .iter()
        .any(|names| !used(scenario, names).is_empty());
    if is_named || is_missed {
        return;
    }
    let text = "the road network has no `LogicFile`; a scenario without roads is valid, but usually the map was \
                forgotten";
    found.issue(network.node(), text);
}

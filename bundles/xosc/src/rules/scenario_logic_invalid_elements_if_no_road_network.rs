use crate::families::road_network::{ON_ROADS, ON_SIGNALS, used};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    if scenario.form() != Form::Scenario || !matches!(scenario.network(), Network::Unnamed) {
        return;
    }
    let network = scenario.root().child("RoadNetwork");
    let is_named = ["LogicFile", "Logics"].iter().any(|name| {
        let file = network.and_then(|network| network.child(name));
        let path = file.map(|file| file.written("filepath"));
        // The schema reports a file without a path.
        path.is_some_and(|path| path.is_none_or(|path| !path.trim().is_empty()))
    });
    if is_named {
        return;
    }
    let kinds = [(ON_ROADS, Level::Error), (ON_SIGNALS, Level::Warning)];
    for (names, level) in kinds {
        for (name, first, count) in used(scenario, names) {
            let many = match count {
                1 => format!("a `{name}` is used"),
                count => format!("`{name}` is used {count} times, first here"),
            };
            let lost = match level {
                Level::Error => "there are no roads that it can refer to",
                _ => "only the simulator can know the signals that it refers to",
            };
            let text =
                format!("{many}, but the scenario has no road network (`LogicFile`); {lost}");
            let finding = found.about(first, "", text).level(level);
            if let Some(network) = network {
                finding.at(network.node(), "the road network without `LogicFile`");
            }
        }
    }
}

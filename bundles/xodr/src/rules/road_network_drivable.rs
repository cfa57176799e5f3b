use crate::families::routes::is_route;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.1.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let leads = |lane: LaneRef<'_, '_>| lane.side().is_some() && is_for_others_too(lane);
    let Some(root) = map.root().filter(|_| !map.lanes().any(leads)) else {
        return;
    };
    // Separate rules cover roads without any lanes.
    if map.lanes().any(|lane| lane.side().is_some()) {
        let text = "no lane of this map has a type for vehicles, such as `driving`; a simulator has no place for \
                    vehicles";
        found.issue(root, text.to_owned());
    }
}

/// Checks whether a lane serves some traffic, including trains on tracks.
fn is_for_others_too(lane: LaneRef<'_, '_>) -> bool {
    is_route(lane) || matches!(lane.kind(), None | Some("rail" | "tram" | "restricted"))
}

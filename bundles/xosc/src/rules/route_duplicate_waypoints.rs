use crate::families::positions::Spot;
use crate::families::routes::{routes, waypoints};
use crate::prelude::*;

pub const RULE: Rule<Scene> = Rule {
    level: Level::Warning,
    run,
    ..Rule::after(READABLE)
};

fn run(scenario: &Scenario<'_>, found: &mut Sink<'_>) {
    for route in routes(scenario) {
        let mut before: Option<(Element<'_, '_>, Element<'_, '_>)> = None;
        for (waypoint, position) in waypoints(route) {
            let here = position.map(|position| (waypoint, position));
            if let (Some((previous, there)), Some((_, position))) = (before, here)
                && is_same(there, position)
            {
                let text = "the waypoint is at the same position as the one before it; it adds nothing to the \
                            route, and another position may be intended";
                found
                    .about(waypoint, "", text)
                    .at(previous.node(), "the waypoint before it");
            }
            before = here;
        }
    }
}

/// Checks whether two positions are the same place, as far as they state it.
fn is_same(one: Element<'_, '_>, other: Element<'_, '_>) -> bool {
    if one.name() != other.name() {
        return false;
    }
    match one.name() {
        "WorldPosition" | "RelativeWorldPosition" | "RelativeObjectPosition" => {
            let spots = one
                .parent()
                .and_then(Spot::of)
                .zip(other.parent().and_then(Spot::of));
            spots
                .and_then(|(one, other)| one.distance(&other))
                .is_some_and(|distance| distance < 1e-6)
        }
        "LanePosition" => are_equal(one, other, &["roadId", "laneId"], &["s", "offset"]),
        "RoadPosition" => are_equal(one, other, &["roadId"], &["s", "t"]),
        _ => false,
    }
}

fn are_equal(
    one: Element<'_, '_>,
    other: Element<'_, '_>,
    words: &[&str],
    numbers: &[&str],
) -> bool {
    let same_word = |name: &&str| {
        let pair = one.text(name).zip(other.text(name));
        pair.is_some_and(|(one, other)| one == other)
    };
    let same_number = |name: &&str| match (one.number(name), other.number(name)) {
        (Some(one), Some(other)) => (one - other).abs() < 1e-6,
        (None, None) => !one.has(name) && !other.has(name),
        _ => false,
    };
    words.iter().all(same_word) && numbers.iter().all(same_number)
}

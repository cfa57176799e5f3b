use std::collections::BTreeSet;

use crate::families::object_parts::is_before;
use crate::families::on_road::OnRoad;
use crate::families::zero_stretches::zero_stretches;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let boundaries = map.junctions().iter().filter_map(Junction::boundary);
    let segments = boundaries.flat_map(|boundary| boundary.segments());
    let edges: BTreeSet<&str> = segments.filter_map(|segment| segment.road_id()).collect();
    let connecting: BTreeSet<&str> = map
        .connections()
        .filter_map(|(_, connection)| connection.connecting_road())
        .collect();
    let demanded = is_before(found, (1, 8));
    for road in map.roads() {
        // Roads that only complete the boundary of a junction need no lanes (12.10).
        let within = road.junction().is_some() && !connecting.contains(road.id());
        let Some(layer) = road
            .permanent()
            .filter(|_| !within && !edges.contains(road.id()))
        else {
            continue;
        };
        for section in layer.sections(road) {
            if !section.lanes().any(is_there) {
                let text = format!(
                    "this lane section of road `{}` needs a left or right lane with width from its start; without one, \
                     it is not drivable",
                    road.id()
                );
                let finding =
                    found
                        .issue(section.node(), text)
                        .on(road, section.s().unwrap_or(0.0), 0.0);
                // Before 1.8, too, a road needed a lane beside the center lane.
                if demanded && section.lanes().all(|lane| lane.side().is_none()) {
                    finding.in_every_version(Level::Warning);
                }
            }
        }
    }
}

fn is_there(lane: LaneRef<'_, '_>) -> bool {
    let from_start = |profile: &Profile<'_>| profile.begin().is_some_and(|begin| begin <= 1e-3);
    let any = [lane.widths(), lane.borders()].into_iter().any(from_start);
    lane.side().is_some() && any && opens(lane)
}

/// Checks whether the lane has width anywhere. If this is unknown, the answer is yes.
fn opens(lane: LaneRef<'_, '_>) -> bool {
    match zero_stretches(lane).zip(lane.length()) {
        Some((zero, length)) => {
            !matches!(zero.as_slice(), [(from, to)] if *from <= 1e-3 && *to >= length - 1e-3)
        }
        None => true,
    }
}

use crate::families::faults::OfFault as _;
use std::collections::{HashMap, HashSet};

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let boundaries = map.junctions().iter().map(Junction::boundary);
    let reached: HashMap<usize, HashSet<Reached<'_>>> = boundaries
        .enumerate()
        .filter_map(|(at, boundary)| Some((at, boundary?.segments().filter_map(joint).collect())))
        .collect();
    for road in map.roads() {
        for end in ContactPoint::BOTH {
            let Some(link) = road.link(end) else { continue };
            let junction = link.junction_id().and_then(|id| map.junction(id));
            let Some((junction, boundary)) = junction.and_then(|one| Some((one, one.boundary()?)))
            else {
                continue;
            };
            let by = |end| {
                let joints = reached.get(&junction.index());
                joints.is_some_and(|joints| joints.contains(&(road.id(), end)))
            };
            if by(Some(end)) || by(None) {
                continue;
            }
            let text = format!(
                "no segment of the boundary of junction `{}` lies at the {end} of road `{}`, which touches \
                 the junction; there must be a segment of type `joint` for the end of every such road",
                junction.id(),
                road.id()
            );
            found
                .issue(boundary.node(), text)
                .at(link.node(), "the link of the road to the junction")
                .in_boundary_of(junction);
        }
    }
}

/// A road with the end at which a joint lies, or `None` for an invalid contact point.
type Reached<'a> = (&'a str, Option<ContactPoint>);

fn joint(segment: BoundarySegment<'_>) -> Option<Reached<'_>> {
    let is_joint = segment.kind() == Some("joint");
    Some((
        segment.road_id().filter(|_| is_joint)?,
        segment.contact_point(),
    ))
}

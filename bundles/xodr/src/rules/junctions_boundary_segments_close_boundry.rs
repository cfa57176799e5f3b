use crate::families::faults::OfFault as _;
use crate::families::junction_area::{Stretch, boundary};
use crate::prelude::*;

const GAP: Param = Param::number(
    "gap",
    0.05,
    "m",
    "maximum distance between the end of a segment and the start of the next one",
);

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "no known reader uses the boundary of a junction without an elevation grid",
    )),
    versions: "1.8.0..",
    params: &[GAP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if let Some(stretches) = boundary(map, junction) {
            check(junction, &stretches, found);
        }
    }
}

fn check(junction: &Junction<'_>, stretches: &[Stretch<'_>], found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let next = stretches.iter().cycle().skip(1);
    for (stretch, next) in stretches.iter().zip(next) {
        let (Some(end), Some(start)) = (stretch.last(), next.first()) else {
            continue;
        };
        let gap = end.distance(start);
        if gap > limit {
            let text = format!(
                "this segment of the boundary of junction `{}` ends {gap:.3} m away from the start of the next \
                 one; at most {limit} m is allowed for a closed boundary",
                junction.id()
            );
            found
                .issue(stretch.segment.node(), text)
                .point(end.x, end.y, 0.0)
                .at(next.segment.node(), "the next segment")
                .point(start.x, start.y, 0.0)
                .in_boundary_of(junction);
        }
    }
}

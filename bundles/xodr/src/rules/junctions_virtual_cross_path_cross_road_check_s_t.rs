use crate::families::cross_paths::{Crossing, Landing, crossings};
use crate::families::virtual_junctions::seen_from;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "largest distance by which the crossing road may extend beyond the other road",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let of_virtual = |one: &Crossing<'_, '_>| one.junction.kind() == Some(JunctionType::Virtual);
    for crossing in crossings(map).filter(of_virtual) {
        for landing in crossing.landings(map) {
            check(&crossing, &landing, found);
        }
    }
}

fn check(crossing: &Crossing<'_, '_>, landing: &Landing<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&TOLERANCE);
    let worst = crossing
        .corners(landing.end)
        .into_iter()
        .flatten()
        .filter_map(|corner| {
            let (s, t) = landing.project(corner)?;
            let pose = landing.other.pose(s)?;
            // Beyond the ends of the road, the foot of the perpendicular stays at the end.
            let (ahead, _) = seen_from(pose, corner);
            let edge = |side: Side| {
                let section = landing
                    .other
                    .permanent()?
                    .section_at(landing.other, side, s)?;
                section.edge_t(side, s - section.s()?)
            };
            let aside = (t - edge(Side::Left)?).max(edge(Side::Right)? - t);
            Some((aside.max(ahead.abs()), corner))
        });
    let worst = worst.max_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((beyond, corner)) = worst.filter(|(beyond, _)| *beyond > limit) {
        let text = format!(
            "crossing road `{}` extends {beyond:.2} m beyond road `{}` at its own {}; it must stay within the \
             length and width of that road",
            crossing.road.id(),
            landing.other.id(),
            landing.end
        );
        found
            .issue(crossing.path.node(), text)
            .point(corner.x, corner.y, 0.0);
    }
}

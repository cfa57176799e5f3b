use crate::families::on_road::OnRoad;
use crate::families::virtual_junctions::{Branch, branches, connecting_roads, seen_from};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "s_tolerance",
    0.001,
    "m",
    "maximum distance between the position that a link names and `sStart` or `sEnd`",
);
const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "maximum distance between the actual end of the road and that position, along the main road",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.6.0" },
    params: &[TOLERANCE, GAP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (junction, road) in connecting_roads(map) {
        let (Some(start), Some(end)) = (junction.s_start(), junction.s_end()) else {
            continue;
        };
        let tolerance = found.number(&TOLERANCE);
        let branches = branches(map, junction, road);
        let proper = |one: &&Branch<'_, '_>| {
            (one.s - start).abs() <= tolerance || (one.s - end).abs() <= tolerance
        };
        match branches.iter().find(proper) {
            Some(branch) => check_place(branch, found),
            None => report(junction, road, &branches, [start, end], found),
        }
    }
}

fn report(
    junction: &Junction<'_>,
    road: &Road<'_>,
    branches: &[Branch<'_, '_>],
    [start, end]: [f64; 2],
    found: &mut Sink<'_>,
) {
    let what = match branches.first() {
        Some(branch) => format!("is linked to it at s = {}", branch.s),
        None => "is not linked to it at either end".to_owned(),
    };
    let text = format!(
        "road `{}` belongs to the virtual junction `{}` of main road `{}`, but {what}; it must start or end \
         at `sStart` = {start} or `sEnd` = {end}",
        road.id(),
        junction.id(),
        junction.main_road().unwrap_or_default()
    );
    let place = branches
        .first()
        .map_or(road.node(), |branch| branch.link.node());
    let end = branches
        .first()
        .map_or(ContactPoint::Start, |branch| branch.end);
    found
        .issue(place, text)
        .at_end(road, end)
        .at(junction.node(), "the virtual junction");
}

/// Checks whether the end of the road lies at the position in its link.
fn check_place(branch: &Branch<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let poses = branch
        .main
        .pose(branch.s)
        .zip(branch.road.end_pose(branch.end));
    let Some((main, pose)) = poses else { return };
    let (ahead, _) = seen_from(main, pose.point());
    if ahead.abs() > limit {
        let text = format!(
            "the {} of road `{}` lies {:.3} m {} s = {} of main road `{}`; it must lie within {limit} m of this \
             position",
            branch.end,
            branch.road.id(),
            ahead.abs(),
            if ahead > 0.0 { "beyond" } else { "before" },
            branch.s,
            branch.main.id()
        );
        found
            .issue(branch.link.node(), text)
            .at_end(branch.road, branch.end);
    }
}

use std::collections::BTreeMap;

use crate::families::virtual_junctions::seen_from;
use crate::prelude::*;

/// Minimum distance of the middles of two lanes that count as side by side, in metres.
const MARGIN: f64 = 0.1;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let direct = |joint: &&LaneJoint<'_>| {
        let junction = joint.junction.and_then(|at| map.junctions().get(at));
        junction.is_some_and(|junction| junction.kind() == Some(JunctionType::Direct))
    };
    // The lane links of a junction, grouped by the road end at which they start.
    let mut fans: BTreeMap<_, Vec<Path<'_>>> = BTreeMap::new();
    for joint in map.junction_joints().iter().filter(direct) {
        for turned in [false, true] {
            if let Some((end, path)) = Path::of(map, joint, turned) {
                fans.entry((joint.junction, end)).or_default().push(path);
            }
        }
    }
    for paths in fans.values_mut() {
        check(paths, found);
    }
}

/// A lane link as a path across the road end at which it starts.
struct Path<'a> {
    /// Position of the first lane across that road, in metres to the left.
    here: f64,
    /// Position of the other lane, measured in the same direction.
    there: f64,
    joint: LaneJoint<'a>,
}

impl<'a> Path<'a> {
    fn of(map: &RoadMap<'a>, joint: &LaneJoint<'a>, turned: bool) -> Option<(RoadEnd, Path<'a>)> {
        let (one, other) = if turned {
            (joint.to, joint.from)
        } else {
            (joint.from, joint.to)
        };
        let end = RoadEnd {
            road: one.lane.road as usize,
            end: one.end,
        };
        let pose = map.road_at(end.road)?.end_pose(end.end)?;
        let across = |at: LaneEnd| {
            let [inner, outer] = map
                .lane(at.lane)?
                .borders_at(at.end)?
                .map(|border| border.point.plan());
            let middle = Point::finite(0.5 * (inner.x + outer.x), 0.5 * (inner.y + outer.y))?;
            Some(seen_from(pose, middle).1)
        };
        let path = Path {
            here: across(one)?,
            there: across(other)?,
            joint: *joint,
        };
        Some((end, path))
    }
}

fn check(paths: &mut [Path<'_>], found: &mut Sink<'_>) {
    paths.sort_by(|one, other| {
        one.here
            .total_cmp(&other.here)
            .then(one.there.total_cmp(&other.there))
    });
    for pair in paths.windows(2) {
        let [one, other] = pair else { continue };
        if one.here < other.here - MARGIN && one.there > other.there + MARGIN {
            let text = "this lane link and another one cross: the lane farther left before the junction is \
                        farther right after it; a direct junction may split or merge roads, but must not cross \
                        traffic";
            found
                .issue(other.joint.node, text)
                .at(one.joint.node, "the lane link that it crosses");
        }
    }
}

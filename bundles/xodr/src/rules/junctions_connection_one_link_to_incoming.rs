use crate::families::connections::{repeated, report_repeated};
use crate::families::faults::OfFault as _;
use crate::families::on_road::{OnRoad, lane_name};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Separate { since: "" },
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let pairs = repeated(junction, |one| one.incoming_road().zip(one.target_road()));
        for ((incoming, target), connections) in pairs {
            let text = format!(
                "{} connections lead from road `{incoming}` to road `{target}`; junction `{}` may have \
                 only one for them, with all lane links",
                connections.len(),
                junction.id()
            );
            report_repeated(map, text, &connections, found);
        }
    }
    for joint in map.junction_joints() {
        against_traffic(map, joint, found);
    }
}

/// Reports a lane link that starts on a lane leading out of the junction. It also reports a target
/// lane whose traffic runs towards the junction.
fn against_traffic(map: &RoadMap<'_>, joint: &LaneJoint<'_>, found: &mut Sink<'_>) {
    let (Some(from), Some(to)) = (map.lane(joint.from.lane), map.lane(joint.to.lane)) else {
        return;
    };
    let leaves = |lane, end| !Traffic::of(lane).may_run_towards(end);
    let (lane, end, fault) = if leaves(from, joint.from.end) {
        let fault = "traffic there leads out of the junction".to_owned();
        (from, joint.from.end, fault)
    } else if leaves(to, joint.to.end.other()) {
        let fault = format!(
            "traffic on {} leads towards the junction as well",
            lane_name(to)
        );
        (to, joint.to.end, fault)
    } else {
        return;
    };
    let text = format!(
        "the lane link leads from {} to {}, but {fault}; only lanes that lead into the junction may \
         be linked, in the direction of traffic",
        lane_name(from),
        lane_name(to)
    );
    found
        .issue(joint.node, text)
        .at_lane_end(lane, end)
        .at(lane.node(), "the lane with the wrong direction")
        .of_junction(joint.node);
}

use qcbus_opendrive::{Road, RoadMap};
use qcbus_sdk::{Backport, Param, Rule, Sink};

use crate::families::lane_gaps::{LaneGap, lane_gaps};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::zero_width::ZERO_WIDTH;
use crate::model::{Part, Roads};

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance in the plan view that is accepted",
);

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_lane_smoothness_contact_point_no_horizontal_gaps",
    uids: &["asam.net:xodr:1.7.0:lane_smoothness.contact_point_no_horizontal_gaps"],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    after: super::READABLE,
    params: &[GAP, ZERO_WIDTH],
    page: include_str!("lane_smoothness_contact_point_no_horizontal_gaps.md"),
    each: Some(each),
    run,
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        reference_line(road, found);
    }
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for gap in lane_gaps(map, found.number(&GAP), found.number(&ZERO_WIDTH)) {
        report(&gap, found);
    }
}

fn reference_line(road: &Road<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let geometries: Vec<_> = road.plan_view().in_order().collect();
    for pair in geometries.windows(2) {
        let (one, next) = (pair[0], pair[1]);
        let (Some(end), Some(start)) = (one.end_point(), next.start_point()) else {
            continue;
        };
        let distance = end.distance(start);
        if distance > limit {
            let text = format!(
                "the reference line of road `{}` ends {distance:.3} m away from the point where its next \
                 geometry starts; at most {limit} m is allowed",
                road.id()
            );
            found
                .issue(next.node(), text)
                .on(road, next.s().unwrap_or(0.0), 0.0)
                .at(one.node(), "the geometry before it");
        }
    }
}

fn report(gap: &LaneGap<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&GAP);
    let apart = match gap.edges.as_slice() {
        [(one, _), (other, _)] => {
            format!("{one:.3} m apart at one edge and {other:.3} m at the other")
        }
        [(one, _), ..] => format!("{one:.3} m apart at one edge"),
        [] => return,
    };
    let text = format!(
        "{} and {} are linked, but lie {apart} where they should touch; at most {limit} m is \
         allowed",
        lane_name(gap.from),
        lane_name(gap.to)
    );
    let mut finding = found
        .issue(gap.from.node(), text)
        .at_lane_end(gap.from, gap.joint.from.end)
        .at(gap.to.node(), "the linked lane");
    for (_, middle) in &gap.edges {
        finding = finding.point(middle.x, middle.y, middle.z);
    }
    finding.at(gap.joint.node, "the link");
}

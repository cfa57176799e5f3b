use crate::families::faults::OfFault as _;
use crate::families::gap_levels::{GAP_BROKEN_FROM, GAP_ERROR_FROM, Misfit};
use crate::families::lane_gaps::{LaneGap, lane_gaps};
use crate::families::mouths;
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::refline::report_gaps;
use crate::families::routes::is_route;
use crate::families::touching::{Where, place_of};
use crate::families::zero_width::ZERO_WIDTH;
use crate::prelude::*;

const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance in the plan view that is accepted",
);

/// Limit for gaps between lanes. Like ASAM's checker, this rule reports all of them as errors.
const LANE_ERROR_FROM: Param = Param::number(
    "lane_error_from",
    0.01,
    "m",
    "from version 1.7 on, gaps between lanes of this size or more are errors; in older files `gap_error_from` \
     applies",
);

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::by_case(
        "readers drive over small gaps between lanes",
    )),
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[
        GAP,
        ZERO_WIDTH,
        LANE_ERROR_FROM,
        GAP_ERROR_FROM,
        GAP_BROKEN_FROM,
    ],
    each: Some(each),
    run,
    ..Rule::after(READABLE)
};

/// First version in which this rule covers reference lines.
const NORMATIVE: Version = Version::new(1, 7);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    // In older files `road.geometry.refline_no_gaps` reports it.
    if !is_normative(found) {
        return;
    }
    let limit = found.number(&GAP);
    for road in map.part(part).roads() {
        report_gaps(road, limit, found, |finding| {
            finding.also_violates("asam.net:xodr:1.4.0:road.geometry.refline_no_gaps");
        });
    }
}

fn is_normative(found: &Sink<'_>) -> bool {
    found.version() >= Some(NORMATIVE)
}

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for gap in lane_gaps(map, found.number(&GAP), found.number(&ZERO_WIDTH)) {
        if !is_of_roads(map, &gap, found) {
            report(map, &gap, found);
        }
    }
}

/// Checks whether the roads themselves do not meet. Then `road.geometry.contact_point` and
/// `road.linkage.ends_meet` report it.
fn is_of_roads(map: &RoadMap<'_>, gap: &LaneGap<'_, '_>, found: &Sink<'_>) -> bool {
    let [from, to] = [gap.joint.from, gap.joint.to].map(road_end);
    let apart = || mouths::apart(map, from, to).unwrap_or(0.0);
    let mouths = from.road != to.road;
    mouths && apart() >= found.number(&GAP_BROKEN_FROM)
}

/// Returns the `laneOffset` that jumps at the boundary of two lane sections of one layer.
fn stepping_offset<'a>(gap: &LaneGap<'_, 'a>, limit: f64) -> Option<Node<'a>> {
    let [from, to] = [gap.from.at, gap.to.at];
    if !std::ptr::eq(from.road, to.road) || !std::ptr::eq(from.layer, to.layer) {
        return None;
    }
    let s = from.s()?.max(to.s()?);
    let offset = from.layer.offset();
    let step = offset.at(s)? - offset.at(Station::before(s))?;
    let mut records = offset.records().iter().filter(|record| {
        let start = record.start();
        start.is_some_and(|start| (start - s).abs() < 1e-6)
    });
    records
        .find(|_| step.abs() > limit)
        .map(|record| record.node())
}

fn road_end(at: LaneEnd) -> RoadEnd {
    RoadEnd {
        road: at.lane.road as usize,
        end: at.end,
    }
}

fn report(map: &RoadMap<'_>, gap: &LaneGap<'_, '_>, found: &mut Sink<'_>) {
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
    let widest = gap.edges.iter().map(|(apart, _)| *apart);
    let widest = widest.fold(0.0, f64::max);
    let by_size = Misfit::gap(widest, gap.whole, found);
    let misfit = match by_size {
        Misfit::Slight if is_normative(found) && widest >= found.number(&LANE_ERROR_FROM) => {
            Misfit::Plain
        }
        // A gap in a lane without through traffic, such as a shoulder, is less harmful.
        Misfit::Broken if !(is_route(gap.from) && is_route(gap.to)) => Misfit::Plain,
        misfit => misfit,
    };
    let mut finding = misfit.put(found.issue(gap.from.node(), text));
    if by_size == Misfit::Slight {
        finding = finding.readers_level(Level::Warning);
    }
    finding = finding
        .at_lane_end(gap.from, gap.joint.from.end)
        .at(gap.to.node(), "the linked lane")
        .at_joint([(gap.from, gap.joint.from.end), (gap.to, gap.joint.to.end)]);
    for (_, middle) in &gap.edges {
        finding = finding.point(middle.x, middle.y, middle.z);
    }
    if let Some(offset) = stepping_offset(gap, limit) {
        finding = finding.at(offset, "the lane offset jumps here");
    }
    finding = finding.at(gap.joint.node, "the link");
    match place_of(map, &gap.joint, gap.from, gap.to) {
        Where::Roads => {}
        Where::Connection { .. } => {
            finding.also_violates("asam.net:xodr:1.9.0:junctions.connection.smooth_fit");
        }
        Where::Direct => {
            finding.also_violates("asam.net:xodr:1.7.0:junctions.direct.linked_lane_smoothness");
        }
    }
}

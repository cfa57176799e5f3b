use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Param, Rule, Sink};

use crate::families::cross_paths::{Crossing, Landing, crossings};
use crate::families::on_road::OnRoad;
use crate::model::Roads;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "how far beside the linked lane a crossing road may begin or end",
);

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_junctions_cross_path_lane_linkage",
    uids: &["asam.net:xodr:1.8.0:junctions.cross_path.lane_linkage"],
    versions: "1.8.0..",
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("junctions_cross_path_lane_linkage.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for crossing in crossings(map) {
        for landing in crossing.landings(map) {
            check(&crossing, &landing, found);
        }
    }
}

fn check(crossing: &Crossing<'_, '_>, landing: &Landing<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&TOLERANCE);
    let lane = landing.link.to();
    let middle = lane.and_then(|lane| crossing.middle(landing.end, lane));
    let Some((s, t)) = middle.and_then(|middle| landing.project(middle)) else {
        return;
    };
    let Some([low, high]) = landing.span(s) else {
        return;
    };
    let beside = (low - t).max(t - high);
    // The link names a place; the crossing road covers it with its width.
    let half = crossing
        .corners(landing.end)
        .map_or(0.0, |[one, other]| 0.5 * one.distance(other));
    let along = (s - landing.s).abs() - half;
    let what = if beside > limit {
        format!(
            "{beside:.2} m beside lane `{}` of road `{}`",
            landing.lane,
            landing.other.id()
        )
    } else if along > 0.1 {
        format!(
            "at s = {s:.2} of road `{}`, not at s = {} as the link says",
            landing.other.id(),
            landing.s
        )
    } else {
        return;
    };
    let text = format!(
        "the {} of crossing road `{}` lies {what}; it must reach the linked lane",
        landing.end,
        crossing.road.id()
    );
    found
        .issue(landing.link.node(), text)
        .at_end(crossing.road, landing.end)
        .at(crossing.road.node(), "the crossing road");
}

use crate::families::on_road::OnRoad;
use crate::families::redundancy::{Repeated, in_lines, in_profile};
use crate::families::shown;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m or rad",
    "largest difference at which two curves count as the same",
);
const TURN: Param = Param::number(
    "turn",
    1e-6,
    "rad",
    "largest difference in heading at which two lines count as one",
);
const GAP: Param = Param::number(
    "gap",
    0.01,
    "m",
    "largest distance at which two lines count as one",
);

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        // ASAM's checker prints this UID. Annex F contains the rule since 1.8.1.
        "asam.net:xodr:1.7.0:performance.avoid_redundant_info",
        "asam.net:xodr:1.8.1:performance.avoid_redundant_info",
    ],
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[TOLERANCE, TURN, GAP],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        of_lines(road, found);
        let Some(length) = road.length() else {
            continue;
        };
        of_road(road, road.elevation(), length, found);
        of_road(road, &road.lateral().superelevation, length, found);
        for layer in road.layers() {
            of_road(road, layer.offset(), length, found);
        }
    }
    for lane in map.part(part).lanes() {
        of_lane(lane, found);
    }
}

fn of_lines(road: &Road<'_>, found: &mut Sink<'_>) {
    let (gap, turn) = (found.number(&GAP), found.number(&TURN));
    for [one, next] in in_lines(road.plan_view(), gap, turn) {
        let text =
            "this line continues in the direction of the line before it; one `geometry` is enough";
        found
            .issue(next.node(), text)
            .on(road, next.s().unwrap_or(0.0), 0.0)
            .at(one.node(), "the line before it");
    }
}

fn of_road(road: &Road<'_>, profile: &Profile<'_>, end: f64, found: &mut Sink<'_>) {
    for repeated in in_profile(profile, end, found.number(&TOLERANCE)) {
        let finding = found.issue(repeated.second.node(), text(&repeated));
        let finding = finding.on(road, repeated.from, 0.0);
        finding.at(repeated.first.node(), "the record before it");
    }
}

fn of_lane(lane: LaneRef<'_, '_>, found: &mut Sink<'_>) {
    let Some(length) = lane.length() else { return };
    for profile in [lane.widths(), lane.borders()] {
        for repeated in in_profile(profile, length, found.number(&TOLERANCE)) {
            let finding = found.issue(repeated.second.node(), text(&repeated));
            let finding = finding.in_lane(lane, repeated.from);
            finding.at(repeated.first.node(), "the record before it");
        }
    }
}

fn text(repeated: &Repeated<'_, '_>) -> String {
    if repeated.to <= repeated.from {
        return format!(
            "this `{}` repeats the one before it and never applies; it should be removed",
            repeated.second.node().name()
        );
    }
    format!(
        "this `{}` repeats the one before it from {} to {} m; it should be removed",
        repeated.second.node().name(),
        shown::number(repeated.from),
        shown::number(repeated.to)
    )
}

use crate::families::edges::{Piece, border, combine, sum};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::rails::rail_lanes;
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "largest distance between the middle of the lane and the reference line that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&TOLERANCE);
    for (lane, kind) in rail_lanes(map) {
        let Some(side) = lane.side() else { continue };
        let rank = lane
            .at
            .side(side)
            .take_while(|other| other.key() != lane.key())
            .count();
        let [inner, outer] = [rank, rank + 1].map(|count| border(lane.at, side, count));
        let middle = combine(&inner, &outer, |one, other| sum(one, other).scaled(0.5));
        let worst = middle.iter().filter_map(Piece::farthest);
        let worst = worst.max_by(|one, other| one.value.abs().total_cmp(&other.value.abs()));
        let Some(worst) = worst.filter(|worst| worst.value.abs() > limit) else {
            continue;
        };
        let text = format!(
            "the middle of {} of type `{kind}` lies {:.2} m from the reference line at s = {:.2}; the reference \
             line must run in the middle between the rails",
            lane_name(lane),
            worst.value.abs(),
            worst.at
        );
        found
            .issue(lane.node(), text)
            .on(lane.at.road, worst.at, worst.value);
    }
}

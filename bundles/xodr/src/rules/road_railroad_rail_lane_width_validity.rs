use crate::families::on_road::{OnRoad, lane_name};
use crate::families::rails::rail_lanes;
use crate::prelude::*;

const TRAM: Param = Param::number("tram", 2.2, "m", "smallest width of a lane for trams");
const RAIL: Param = Param::number("rail", 2.6, "m", "smallest width of a lane for trains");

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "" },
    params: &[TRAM, RAIL],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for (lane, kind) in rail_lanes(map) {
        let limit = found.number(if kind == "tram" { &TRAM } else { &RAIL });
        let Some(length) = lane.length() else {
            continue;
        };
        let lowest = lane.widths().stretches(length).filter_map(|stretch| {
            let lowest = stretch.cubic.minimum(0.0, stretch.length())?;
            Some((
                lowest.value,
                stretch.from + lowest.at,
                stretch.record.node(),
            ))
        });
        let lowest = lowest.min_by(|one, other| one.0.total_cmp(&other.0));
        let Some((width, ds, record)) = lowest.filter(|(width, ..)| *width < limit) else {
            continue;
        };
        let text = format!(
            "{} has type `{kind}`, but is only {width:.2} m wide at s = {:.2}; it must be at least as wide as \
             the vehicles on it (assumed: {limit} m)",
            lane_name(lane),
            lane.at.s().unwrap_or(0.0) + ds
        );
        found.issue(record, text).in_lane(lane, ds);
    }
}

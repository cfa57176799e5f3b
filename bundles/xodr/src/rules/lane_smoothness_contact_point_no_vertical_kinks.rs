use crate::families::on_road::OnRoad;
use crate::families::shown::number;
use crate::families::touching::{GAP, STEP, Where, pairs};
use crate::prelude::*;

const PITCH: Param = Param::number(
    "pitch",
    0.02,
    "",
    "largest difference between two slopes (height over distance) that is accepted",
);

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    params: &[PITCH, GAP, STEP],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let limit = found.number(&PITCH);
    for pair in pairs(map.part(part)) {
        let has_grid = pair.at
            == Where::Connection {
                elevation_grid: true,
            };
        if has_grid || pair.is_kerb() {
            continue;
        }
        let edge = pair.pitch(found.number(&GAP), found.number(&STEP));
        if let Some(edge) = edge.filter(|edge| edge.amount > limit) {
            let text = format!(
                "the slopes of their {} edges differ by {:.2} % where they touch; they should not differ by more \
                 than {:.2} %",
                edge.side,
                100.0 * edge.amount,
                100.0 * limit
            );
            pair.report(&text, edge.point, found);
        }
    }
    for road in map.part(part).roads() {
        within(road, found);
    }
}

/// Reports kinks of the elevation itself, where lanes continue without a link.
fn within(road: &Road<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&PITCH);
    let profile = road.elevation();
    let mut last = None;
    for record in profile.in_order().skip(1) {
        // Of several records at one place only the last one applies.
        let Some(s) = record.start().filter(|s| last != Some(*s)) else {
            continue;
        };
        last = Some(s);
        let before = Station::before(s);
        let slopes = profile.slope_at(before).zip(profile.slope_at(s));
        let heights = profile.at(before).zip(profile.at(s));
        let (Some((before, after)), Some((low, high))) = (slopes, heights) else {
            continue;
        };
        let is_step = (high - low).abs() > found.number(&STEP);
        if (after - before).abs() > limit && !is_step {
            let text = format!(
                "the slope of road `{}` changes from {:.2} % to {:.2} % at s = {}; it should not change by more \
                 than {:.2} % at once",
                road.id(),
                100.0 * before,
                100.0 * after,
                number(s),
                100.0 * limit
            );
            found.issue(record.node(), text).on(road, s, 0.0);
        }
    }
}

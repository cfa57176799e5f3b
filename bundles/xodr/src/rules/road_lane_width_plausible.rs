use crate::families::on_road::{OnRoad, lane_name};
use crate::families::routes::is_route;
use crate::families::written_numbers::brief;
use crate::prelude::*;

const LEAST: Param = Param::number(
    "least",
    1.5,
    "m",
    "smallest width of a lane that has room for vehicles",
);
const MOST: Param = Param::number(
    "most",
    10.0,
    "m",
    "largest plausible width of a single lane for vehicles",
);
const ASIDE: Param = Param::number(
    "aside",
    20.0,
    "m",
    "largest plausible width of a lane for pedestrians, bicycles or parking, of a curb and of a shoulder",
);
const ANY: Param = Param::number(
    "any",
    100.0,
    "m",
    "largest plausible width of any other lane",
);
const LENGTH: Param = Param::number(
    "length",
    10.0,
    "m",
    "smallest length over which a too narrow or too wide lane is reported",
);

/// Change of width in metres above which a lane counts as opening or closing.
const STEADY: f64 = 0.3;
/// Width in metres below which the lane is intentionally absent.
const NOTHING: f64 = 0.05;

/// Start value of a record in metres above which another rule reports the number as invalid.
const ABSURD: f64 = 1e9;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[LEAST, MOST, ASIDE, ANY, LENGTH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for lane in map.part(part).lanes() {
        let Some(length) = lane.length() else {
            continue;
        };
        let traffic = is_route(lane);
        let wide = lane
            .widths()
            .stretches(length)
            .find_map(|stretch| Some((stretch, wide(&stretch, lane, found)?)));
        match wide {
            Some((stretch, width)) => report_wide(lane, &stretch, width, found),
            None if traffic && length >= found.number(&LENGTH) => narrow(lane, length, found),
            None => {}
        }
    }
}

/// Returns the largest plausible width of a lane, and a name for lanes of its kind.
fn most(lane: LaneRef<'_, '_>, found: &Sink<'_>) -> (f64, String) {
    let kind = lane.kind().unwrap_or_default();
    match kind {
        _ if is_route(lane) => (found.number(&MOST), "lane for vehicles".to_owned()),
        "sidewalk" | "walking" | "biking" | "curb" | "shoulder" | "stop" | "parking" => {
            (found.number(&ASIDE), format!("lane of type `{kind}`"))
        }
        _ => (found.number(&ANY), "lane".to_owned()),
    }
}

/// Returns the width of a stretch that is too wide for a lane.
fn wide(stretch: &Stretch<'_, '_>, lane: LaneRef<'_, '_>, found: &Sink<'_>) -> Option<f64> {
    let length = stretch.length();
    let (most, _) = most(lane, found);
    let greatest = stretch.cubic.maximum(0.0, length)?.value;
    if greatest > found.number(&ANY) {
        return (stretch.cubic.a.abs() < ABSURD).then_some(greatest);
    }
    if greatest <= most || length < found.number(&LENGTH) {
        return None;
    }
    // Lanes at junctions widen only at their ends.
    let least = [0.25, 0.5, 0.75]
        .map(|share| stretch.cubic.value(share * length))
        .into_iter()
        .fold(f64::INFINITY, f64::min);
    (least > most).then_some(greatest)
}

fn report_wide(lane: LaneRef<'_, '_>, stretch: &Stretch<'_, '_>, width: f64, found: &mut Sink<'_>) {
    let (most, what) = most(lane, found);
    let text = format!(
        "{} is up to {} m wide; a {what} of more than {most} m is implausible; widths are in metres",
        lane_name(lane),
        brief(width, 1)
    );
    let ds = 0.5 * (stretch.from + stretch.to);
    found.issue(stretch.record.node(), text).in_lane(lane, ds);
}

/// Reports a lane that is narrow along its whole length and does not just open or close.
fn narrow(lane: LaneRef<'_, '_>, length: f64, found: &mut Sink<'_>) {
    let least = found.number(&LEAST);
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    let mut first = None;
    for stretch in lane.widths().stretches(length) {
        let (Some(lowest), Some(highest)) = (
            stretch.cubic.minimum(0.0, stretch.length()),
            stretch.cubic.maximum(0.0, stretch.length()),
        ) else {
            return;
        };
        low = low.min(lowest.value);
        high = high.max(highest.value);
        first = first.or(Some(stretch.record.node()));
        if high >= least {
            return;
        }
    }
    let Some(node) = first.filter(|_| low > NOTHING && high - low < STEADY) else {
        return;
    };
    let text = format!(
        "{} is at most {high:.3} m wide over {length:.1} m; vehicles need at least {least} m",
        lane_name(lane)
    );
    found.issue(node, text).in_lane(lane, 0.5 * length);
}

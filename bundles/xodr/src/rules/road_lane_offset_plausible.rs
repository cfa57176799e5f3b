use crate::families::on_road::OnRoad;
use crate::families::written_numbers::brief;
use crate::prelude::*;
use qcbus_opendrive::LaneLayer;

const MOST: Param = Param::number(
    "most",
    50.0,
    "m",
    "largest lateral shift of lanes from the reference line that is accepted",
);
const SLOPE: Param = Param::number(
    "slope",
    1.0,
    "",
    "largest lateral shift of lanes that is accepted, in metres sideways per metre along the road",
);
const LENGTH: Param = Param::number(
    "length",
    5.0,
    "m",
    "smallest length over which a too steep shift of lanes is reported",
);

/// Offset in metres above which another rule reports the number as invalid.
const ABSURD: f64 = 1e9;
/// Number of pieces of a stretch for measuring its steep part.
const PIECES: u32 = 64;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[MOST, SLOPE, LENGTH],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for layer in road.layers() {
            one(road, layer, found);
        }
    }
}

/// Reports the first offset of a layer that is too large, otherwise the first slope that is too
/// steep. Lanes after a steep record are usually shifted too far as well.
fn one(road: &Road<'_>, layer: &LaneLayer<'_>, found: &mut Sink<'_>) {
    let Some(length) = road.length() else {
        return;
    };
    let mut steep = None;
    for stretch in layer.offset().stretches(length) {
        if let Some((ds, offset)) = far(&stretch, found) {
            let text = format!(
                "the lanes of road `{}` are shifted by {} m from the reference line at s = {:.1}; more than {} m \
                 is implausible",
                road.id(),
                brief(offset, 1),
                stretch.from + ds,
                found.number(&MOST)
            );
            let place = stretch.from + ds;
            found
                .issue(stretch.record.node(), text)
                .on(road, place, offset);
            return;
        }
        if steep.is_none() {
            steep = steepest(&stretch, found).map(|worst| (stretch, worst));
        }
    }
    if let Some((stretch, (ds, slope, over))) = steep {
        let text = format!(
            "the lanes of road `{}` are shifted sideways by up to {} m per metre along the road; more than {} m \
             per metre, here over {over:.1} m, is implausible",
            road.id(),
            brief(slope.abs(), 2),
            brief(found.number(&SLOPE), 2)
        );
        let place = stretch.from + ds;
        let t = stretch.cubic.value(ds);
        found.issue(stretch.record.node(), text).on(road, place, t);
    }
}

/// Returns the position and size of the largest shift of the lanes if it is too large.
fn far(stretch: &Stretch<'_, '_>, found: &Sink<'_>) -> Option<(f64, f64)> {
    let length = stretch.length();
    let lowest = stretch.cubic.minimum(0.0, length)?;
    let highest = stretch.cubic.maximum(0.0, length)?;
    let farthest = if -lowest.value > highest.value {
        lowest
    } else {
        highest
    };
    let offset = farthest.value;
    let is_far = offset.abs() > found.number(&MOST) && offset.abs() < ABSURD;
    is_far.then_some((farthest.at, offset))
}

/// Returns the position and slope of the steepest shift of the lanes, and the length that is too
/// steep. It returns them only if that length is more than a few metres.
fn steepest(stretch: &Stretch<'_, '_>, found: &Sink<'_>) -> Option<(f64, f64, f64)> {
    let length = stretch.length();
    let (most, least) = (found.number(&SLOPE), found.number(&LENGTH));
    let cubic = &stretch.cubic;
    let is_constant = [cubic.b, cubic.c, cubic.d] == [0.0; 3];
    if length < least || is_constant {
        return None;
    }
    let piece = length / f64::from(PIECES);
    let (mut worst, mut over) = ((0.0, 0.0_f64), 0.0);
    for index in 0..PIECES {
        let ds = (f64::from(index) + 0.5) * piece;
        let slope = cubic.slope(ds);
        if slope.abs() > most {
            over += piece;
        }
        if slope.abs() > worst.1.abs() {
            worst = (ds, slope);
        }
    }
    (over >= least && worst.1.abs() < ABSURD).then_some((worst.0, worst.1, over))
}

use crate::families::gap_levels::{KINK_ERROR_FROM, Misfit, STEP_BROKEN_FROM, STEP_ERROR_FROM};
use crate::families::touching::{Pair, STEP, Where, pairs, report_step};
use crate::prelude::*;

const ROLL: Param = Param::number(
    "roll",
    0.01,
    "rad",
    "largest difference between the crossfalls of two lanes that is accepted",
);

/// Minimum width for comparing crossfalls, in metres. Rounded heights tilt narrower lanes.
const TOO_NARROW: f64 = 2.0;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    params: &[
        STEP,
        ROLL,
        STEP_ERROR_FROM,
        STEP_BROKEN_FROM,
        KINK_ERROR_FROM,
    ],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    // Separate rules cover junctions: `junctions.connection.smooth_fit` and similar ones.
    for pair in pairs(map.part(part)).filter(|pair| pair.at == Where::Roads && !pair.is_kerb()) {
        if !report_step(&pair, found) {
            report_roll(&pair, found);
        }
    }
}

/// Reports different crossfalls. Lanes that meet at one edge only, as at a split, may have them.
fn report_roll(pair: &Pair<'_, '_>, found: &mut Sink<'_>) {
    let limit = found.number(&ROLL);
    if let Some(roll) = pair.roll(TOO_NARROW).filter(|roll| *roll > limit) {
        let text = format!(
            "their crossfalls differ by {roll:.4} rad ({:.2}°) where they touch; at most {limit} rad is allowed",
            roll.to_degrees()
        );
        let misfit = Misfit::kink(roll, found);
        misfit.put(pair.report(&text, pair.touching.left[0], found));
    }
}

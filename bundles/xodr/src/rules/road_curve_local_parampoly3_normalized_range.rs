use crate::families::outline_curves::{LENGTH_TOLERANCE, range_fits};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    params: &[LENGTH_TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    range_fits(map, ParamRange::Normalized, found);
}

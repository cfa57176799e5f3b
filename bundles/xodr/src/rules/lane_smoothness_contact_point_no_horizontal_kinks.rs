use crate::families::gap_levels::{KINK_BROKEN_FROM, KINK_ERROR_FROM};
use crate::families::touching::{GAP, KINK, Where, pairs, report_kink};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    backport: Backport::Lower { since: "" },
    params: &[GAP, KINK, KINK_ERROR_FROM, KINK_BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    // Separate rules cover junctions: `junctions.connection.smooth_fit` and similar ones.
    for pair in pairs(map.part(part)).filter(|pair| pair.at == Where::Roads && !pair.is_kerb()) {
        report_kink(&pair, found.number(&KINK_BROKEN_FROM), found);
    }
}

use crate::families::curve_length::{self, LENGTH_TOLERANCE};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    uids: &[
        // ASAM's checker and annex F use different spellings.
        "asam.net:xodr:1.7.0:road.geometry.parampoly3.normalized_range",
        "asam.net:xodr:1.7.0:road.geometry.paramPoly3.normalized_range",
    ],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    params: &[LENGTH_TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    curve_length::range_fits(map.part(part), ParamRange::Normalized, found);
}

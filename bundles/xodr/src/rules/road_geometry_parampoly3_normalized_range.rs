use crate::families::curve_length::{self, LENGTH_TOLERANCE};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_geometry_parampoly3_normalized_range",
    uids: &[
        // ASAM's checker and annex F use different spellings.
        "asam.net:xodr:1.7.0:road.geometry.parampoly3.normalized_range",
        "asam.net:xodr:1.7.0:road.geometry.paramPoly3.normalized_range",
    ],
    versions: "1.7.0..",
    backport: Backport::Separate { since: "" },
    after: super::READABLE,
    params: &[LENGTH_TOLERANCE],
    page: include_str!("road_geometry_parampoly3_normalized_range.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    curve_length::range_fits(map.part(part), ParamRange::Normalized, found);
}

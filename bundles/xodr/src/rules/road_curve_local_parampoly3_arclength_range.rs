use crate::families::outline_curves::{LENGTH_TOLERANCE, range_fits};
use crate::prelude::*;

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_curve_local_parampoly3_arclength_range",
    uids: &["asam.net:xodr:1.9.0:road.curve_local.paramPoly3.arcLength_range"],
    versions: "1.9.0..",
    after: super::READABLE,
    params: &[LENGTH_TOLERANCE],
    page: include_str!("road_curve_local_parampoly3_arclength_range.md"),
    run,
    ..Rule::DEFAULTS
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    range_fits(map, ParamRange::ArcLength, found);
}

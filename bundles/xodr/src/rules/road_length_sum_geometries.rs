use qcbus_opendrive::RoadMap;
use qcbus_sdk::{Backport, Level, Param, Place, Rule, Sink};

use crate::model::{Part, Roads};

pub static RULE: Rule<Roads> = Rule {
    id: "check_asam_xodr_road_length_sum_geometries",
    uids: &["asam.net:xodr:1.9.0:road.length_sum_geometries"],
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.4.0" },
    after: super::READABLE,
    params: &[TOLERANCE],
    page: include_str!("road_length_sum_geometries.md"),
    each: Some(each),
    ..Rule::DEFAULTS
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest difference that is accepted, on long roads a millionth of the length",
);
/// What a sum of lengths written with few digits may be off, as a share of it.
const RELATIVE: f64 = 1e-6;

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    for road in map.part(part).roads() {
        let geometries = road.plan_view().geometries();
        let sum: Option<f64> = geometries.iter().map(|geometry| geometry.length()).sum();
        let (Some(length), Some(sum)) = (road.length(), sum.filter(|_| !geometries.is_empty()))
        else {
            continue;
        };
        if (length - sum).abs() > tolerance.max(RELATIVE * sum) {
            let text = format!(
                "road `{}` is said to be {length} m long, but its geometries are {sum} m long together; the \
                 two should be equal (accepted: {tolerance} m)",
                road.id()
            );
            found
                .issue(Place::attribute_or_node(road.node(), "length"), text)
                .road(road.id(), length.min(sum), 0.0);
        }
    }
}

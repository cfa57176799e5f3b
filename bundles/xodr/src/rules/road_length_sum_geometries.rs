use crate::families::faults::lengths_of;
use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.9.0..",
    backport: Backport::Lower { since: "1.1.0" },
    params: &[TOLERANCE, BROKEN_FROM],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest difference that is accepted; on long roads, a millionth of the length",
);
const BROKEN_FROM: Param = Param::number(
    "broken_from",
    1.0,
    "m",
    "from this difference on, a part of the road has no position, or a part of its reference line has no road; \
     this is an error in every version",
);
/// Relative tolerance for a sum of lengths that are written with few digits.
const RELATIVE: f64 = 1e-6;

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let broken_from = found.number(&BROKEN_FROM);
    for road in map.part(part).roads() {
        let geometries = road.plan_view().geometries();
        if geometries
            .iter()
            .any(|one| one.length().is_some_and(|length| length < 0.0))
        {
            continue;
        }
        let sum: Option<f64> = geometries.iter().map(|geometry| geometry.length()).sum();
        let (Some(length), Some(sum)) = (road.length(), sum.filter(|_| !geometries.is_empty()))
        else {
            continue;
        };
        if (length - sum).abs() > tolerance.max(RELATIVE * sum) {
            let text = format!(
                "the given length of road `{}` is {} m, but its geometries have a total length of {} m; the two \
                 should be equal (accepted difference: {tolerance} m)",
                road.id(),
                number(length),
                number(sum)
            );
            let finding = found.issue(Place::attribute_or_node(road.node(), "length"), text);
            let finding = if (length - sum).abs() >= broken_from {
                finding.in_every_version(Level::Error)
            } else {
                finding
            };
            finding
                .road(road.id(), length.min(sum), 0.0)
                .follows(lengths_of(road));
        }
    }
}

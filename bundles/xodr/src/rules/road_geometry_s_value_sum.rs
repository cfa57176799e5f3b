use crate::families::faults::lengths_of;
use crate::families::shown::number;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.9.0..",
    backport: Backport::Alike { since: "1.1.0" },
    params: &[TOLERANCE, GRAVE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-3,
    "m",
    "largest deviation that is accepted; on long roads, a millionth of the sum",
);
const GRAVE: Param = Param::number(
    "grave",
    0.1,
    "m",
    "in versions before 1.9, a deviation up to this is a warning",
);
/// Relative tolerance for a sum of lengths that are written with few digits.
const RELATIVE: f64 = 1e-6;

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let grave = found.number(&GRAVE);
    let older = found.version() < Some(Version::new(1, 9));
    for road in map.part(part).roads() {
        let mut sum = 0.0;
        let mut first = None;
        let mut greatest = 0.0_f64;
        let mut further = 0;
        for geometry in road.plan_view().geometries() {
            let (Some(s), Some(length)) = (geometry.s(), geometry.length()) else {
                break;
            };
            // Another checker reports a negative length. After it the sums are meaningless.
            if length < 0.0 {
                break;
            }
            if (s - sum).abs() > tolerance.max(RELATIVE * sum) {
                greatest = greatest.max((s - sum).abs());
                match first {
                    None => first = Some((geometry, s, sum)),
                    Some(_) => further += 1,
                }
            }
            sum += length;
        }
        let Some((geometry, s, sum)) = first else {
            continue;
        };
        let more = match further {
            0 => String::new(),
            1 => "; another `geometry` of this road deviates as well".to_owned(),
            many => format!("; {many} further `geometry` elements of this road deviate as well"),
        };
        let demand = match sum {
            0.0 => "the reference line starts at s = 0".to_owned(),
            _ => format!(
                "the geometries before this one have a total length of {} m",
                number(sum)
            ),
        };
        let text = format!(
            "s is {}, but {demand}; s must be the sum of all lengths before it (accepted deviation: {tolerance} \
             m){more}",
            number(s)
        );
        let finding = found
            .issue(Place::attribute_or_node(geometry.node(), "s"), text)
            .road(road.id(), s, 0.0)
            .fault(lengths_of(road));
        let finding = if older && greatest <= grave {
            finding.level(Level::Warning)
        } else {
            finding
        };
        if let Some(at) = geometry.origin() {
            finding.point(at.x, at.y, 0.0);
        }
    }
}

use crate::prelude::*;
use qcbus_opendrive::Strip;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    1e-6,
    "m",
    "largest amount below zero that is accepted for a width",
);

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        let Some(surface) = &road.lateral().cross_section_surface else {
            continue;
        };
        for inner in [1, -1] {
            let (Some(strip), Some(outer)) = (surface.strip(inner), surface.strip(2 * inner))
            else {
                continue;
            };
            if strip.width.is_empty() {
                let text = format!(
                    "strip {inner} has no width, but strip {} lies outside of it; the inner one of two strips \
                     must have a width",
                    2 * inner
                );
                found
                    .issue(strip.node(), text)
                    .at(outer.node(), "the outer strip");
            } else {
                check_width(strip, road, found);
            }
        }
    }
}

/// Reports a negative width at any place.
fn check_width(strip: &Strip<'_>, road: &Road<'_>, found: &mut Sink<'_>) {
    let Some(length) = road.length() else { return };
    let tolerance = found.number(&TOLERANCE);
    for stretch in strip.width.stretches(length) {
        let Some(least) = stretch.cubic.minimum(0.0, stretch.length()) else {
            continue;
        };
        if least.value < -tolerance {
            let s = stretch.from + least.at;
            let text = format!(
                "the width of the strip at s = {s} is {} m; it must not be negative",
                least.value
            );
            found
                .issue(stretch.record.node(), text)
                .road(road.id(), s, 0.0);
        }
    }
}

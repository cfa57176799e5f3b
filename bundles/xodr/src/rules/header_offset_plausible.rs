use std::f64::consts::TAU;

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[DISTANCE, HEIGHT],
    run,
    ..Rule::after(READABLE)
};

/// Maximum x and y. Gauss and Krüger zones may precede the easting: 60 500 000 is the middle of the
/// sixtieth.
const DISTANCE: Param = Param::number(
    "distance",
    1e8,
    "m",
    "maximum x and y of the offset that a projection can give",
);

const HEIGHT: Param = Param::number(
    "height",
    1e4,
    "m",
    "maximum z of the offset that counts as a height on Earth",
);

/// Smallest relevant heading. Smaller ones have no effect: at 100 km they are 0.1 mm.
const LEAST_HEADING: f64 = 1e-9;

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let Some(offset) = map.header().and_then(|header| header.child("offset")) else {
        return;
    };
    // Another rule reports values that are not finite numbers.
    let value = |name| offset.f64(name).ok().filter(|number| number.is_finite());
    for (name, limit) in [("x", &DISTANCE), ("y", &DISTANCE), ("z", &HEIGHT)] {
        let limit = found.number(limit);
        if let Some(number) = value(name).filter(|number| number.abs() > limit) {
            let text = format!(
                "`{name}` of the offset is {number} m; no place on Earth has this value in any projection (at \
                 most {limit} m is accepted)"
            );
            found.issue(Place::attribute_or_node(offset, name), text);
        }
    }
    let Some(heading) = value("hdg").filter(|heading| heading.abs() > LEAST_HEADING) else {
        return;
    };
    let (level, text) = if heading.abs() > TAU {
        (
            Level::Warning,
            format!(
                "`hdg` of the offset is {heading} rad, more than a full turn of 6.283; if it was meant in \
                 degrees, it is {:.6} rad",
                heading.to_radians()
            ),
        )
    } else {
        (
            Level::Information,
            format!(
                "`hdg` of the offset turns the whole map by {:.3}°; rotation should be avoided, because many \
                 readers ignore it",
                heading.to_degrees()
            ),
        )
    };
    found
        .issue(Place::attribute_or_node(offset, "hdg"), text)
        .level(level);
}

use crate::families::faults::OfFault as _;
use crate::families::junction_area::{Stretch, boundary, doubled_area, ring};
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    readers: Some(Readers::warning(
        "no known reader uses the boundary of a junction without an elevation grid",
    )),
    versions: "1.8.0..",
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        if let Some(stretches) = boundary(map, junction) {
            check(junction, &stretches, found);
        }
    }
}

fn check(junction: &Junction<'_>, stretches: &[Stretch<'_>], found: &mut Sink<'_>) {
    let ring = ring(stretches);
    let area = 0.5 * doubled_area(&ring);
    let (Some(node), Some(first)) = (junction.node().child("boundary"), ring.first()) else {
        return;
    };
    if area < 0.0 {
        let text = format!(
            "the boundary of junction `{}` runs clockwise around {:.1} m²; its segments must be in counter-clockwise \
             order",
            junction.id(),
            -area
        );
        found
            .issue(node, text)
            .point(first.x, first.y, 0.0)
            .in_boundary_of(junction);
    }
}

use crate::families::junction_area::{boundary, line_node, reference_line, ring};
use crate::families::polygons::{distance_to_line, sides};
use crate::prelude::*;

const GAP: Param = Param::number(
    "gap",
    0.05,
    "m",
    "maximum distance between the line and the boundary at which they touch",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[GAP],
    run,
    ..Rule::after(READABLE)
};

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    for junction in map.junctions() {
        let line = reference_line(junction);
        if let (Some(line), Some(stretches)) = (line, boundary(map, junction)) {
            check(junction, &line, &ring(&stretches), found);
        }
    }
}

fn check(junction: &Junction<'_>, line: &Placed, ring: &[Point], found: &mut Sink<'_>) {
    let (Some(start), Some(end)) = (line.point(0.0), line.point(line.length)) else {
        return;
    };
    let limit = found.number(&GAP);
    let nearest = sides(ring).map(|(one, other)| apart(start, end, one, other));
    let nearest = nearest.fold(f64::INFINITY, f64::min);
    if nearest.is_finite() && nearest > limit {
        let text = format!(
            "the reference line of junction `{}` neither crosses nor touches the junction's boundary: it lies \
             {nearest:.3} m away from it",
            junction.id()
        );
        found
            .issue(line_node(junction), text)
            .point(start.x, start.y, 0.0);
    }
}

/// Returns the distance between two line segments, zero if they cross.
fn apart(a: Point, b: Point, c: Point, d: Point) -> f64 {
    let side = |p: Point, q: Point, r: Point| (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
    let crosses = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
    if crosses {
        return 0.0;
    }
    let ends = [
        distance_to_line(a, c, d),
        distance_to_line(b, c, d),
        distance_to_line(c, a, b),
        distance_to_line(d, a, b),
    ];
    ends.into_iter().fold(f64::INFINITY, f64::min)
}

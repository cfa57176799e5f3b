use crate::families::junction_area::{beside, boundary, line_node, reference_line, ring};
use crate::prelude::*;

const TOLERANCE: Param = Param::number(
    "tolerance",
    0.05,
    "m",
    "maximum distance by which the junction may extend beyond the ends of the line",
);

pub const RULE: Rule<Roads> = Rule {
    versions: "1.8.0..",
    params: &[TOLERANCE],
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
    let limit = found.number(&TOLERANCE);
    let beyond = ring.iter().map(|point| {
        let (s, _) = beside(line, *point);
        ((-s).max(s - line.length), *point)
    });
    let worst = beyond.max_by(|one, other| one.0.total_cmp(&other.0));
    if let Some((beyond, point)) = worst.filter(|(beyond, _)| *beyond > limit) {
        let text = format!(
            "the junction `{}` extends {beyond:.2} m beyond the end of its reference line; every point of the \
             junction must be at a right angle to a point of the line",
            junction.id()
        );
        found
            .issue(line_node(junction), text)
            .point(point.x, point.y, 0.0);
    }
}

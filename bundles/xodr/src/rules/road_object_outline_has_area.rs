use crate::families::object_parts::named;
use crate::families::on_road::OnRoad;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[THIN],
    each: Some(each),
    ..Rule::after(READABLE)
};

const THIN: Param = Param::number(
    "thin",
    0.01,
    "m",
    "width of an outline up to which its corners lie on one line",
);

/// Types of objects that are areas. Others may be walls or lines.
const AREAS: [&str; 4] = ["crosswalk", "parkingSpace", "trafficIsland", "building"];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    let thin = found.number(&THIN);
    for (road, object) in map.part(part).objects() {
        for outline in object.outlines() {
            let Some(corners) = corners(&outline) else {
                continue;
            };
            let is_area = object.kind().is_some_and(|kind| AREAS.contains(&kind));
            let what = if corners.iter().all(|one| one.distance(corners[0]) <= thin) {
                "at one place"
            } else if is_area && outline.closed() != Some(false) && width(&corners) <= thin {
                "on one line"
            } else {
                continue;
            };
            let text = format!(
                "all {} corners of this outline of {} lie {what}, so the object has no area and is not there; the \
                 corners should go around it",
                corners.len(),
                named(object.node())
            );
            found.issue(outline.node(), text).on(
                road,
                object.s().unwrap_or(0.0),
                object.t().unwrap_or(0.0),
            );
        }
    }
}

/// Returns the corners of an outline with three or more of them in a plane: in s and t, or in u and
/// v. Returns `None` for curves and for outlines that stand upright.
fn corners(outline: &Outline<'_>) -> Option<Vec<Point>> {
    let mut kind = None;
    let mut heights: Vec<f64> = Vec::new();
    let points = outline.corners().map(|corner| {
        let point = corner.point;
        if *kind.get_or_insert(corner.kind) != corner.kind {
            return None;
        }
        match corner.kind {
            CornerKind::Road => {
                heights.push(point.dz().unwrap_or(0.0));
                Point::finite(point.s()?, point.t()?)
            }
            CornerKind::Local => {
                heights.push(point.z().unwrap_or(0.0));
                Point::finite(point.u()?, point.v()?)
            }
            CornerKind::Curve => None,
        }
    });
    let points = points.collect::<Option<Vec<_>>>()?;
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let is_level = heights.iter().all(|height| height - low <= 0.01);
    (points.len() >= 3 && is_level).then_some(points)
}

/// Returns the width of a polygon across the line from its first corner to the farthest one.
fn width(corners: &[Point]) -> f64 {
    let from = corners[0];
    let far = corners
        .iter()
        .copied()
        .max_by(|one, other| from.distance(*one).total_cmp(&from.distance(*other)));
    let Some(to) = far else { return 0.0 };
    let length = from.distance(to);
    let off = |point: &Point| {
        ((to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x)) / length
    };
    let most = corners.iter().map(off).fold(0.0, f64::max);
    let least = corners.iter().map(off).fold(0.0, f64::min);
    most - least
}

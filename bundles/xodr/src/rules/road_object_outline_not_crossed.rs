use crate::families::object_parts::named;
use crate::families::on_road::OnRoad;
use crate::prelude::*;
use qcbus_opendrive::Corner;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    each: Some(each),
    ..Rule::after(READABLE)
};

/// Maximum number of checked corners, because each side is compared with all others.
const MOST: usize = 200;
/// Minimum length in metres by which a side must extend beyond another one to cross it.
const ROUNDING: f64 = 1e-3;

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for (road, object) in map.part(part).objects() {
        for outline in object.outlines() {
            check(road, &object, &outline, found);
        }
    }
}

fn check(road: &Road<'_>, object: &Object<'_>, outline: &Outline<'_>, found: &mut Sink<'_>) {
    let Some(corners) = corners(outline) else {
        return;
    };
    let count = corners.len();
    if !(4..=MOST).contains(&count) {
        return;
    }
    if is_upright(&corners) {
        return;
    }
    // An open outline has no last side. Painted lines in old versions are implicitly open.
    let sides = match outline.closed() {
        Some(true) => count,
        Some(false) | None => count - 1,
    };
    let side = |index: usize| Some((corners.get(index)?, corners.get((index + 1) % count)?));
    for one in 0..sides {
        for other in one + 2..sides {
            if one == 0 && other + 1 == count {
                continue;
            }
            let (Some(first), Some(second)) = (side(one), side(other)) else {
                continue;
            };
            if cross([first.0.1, first.1.1], [second.0.1, second.1.1]) {
                let text = format!(
                    "the outline of {} crosses itself: its side from corner {} to the next one meets the side \
                     from corner {}; the corners should go around the outline once",
                    named(object.node()),
                    one + 1,
                    other + 1
                );
                found
                    .issue(outline.node(), text)
                    .on(road, object.s().unwrap_or(0.0), object.t().unwrap_or(0.0))
                    .at(first.0.0, "the start of one side")
                    .at(second.0.0, "the start of the other side");
                return;
            }
        }
    }
}

/// Returns the corners in a plane: in s and t if all are on the road, in u and v if all are local.
/// Returns `None` for curves, because they deviate from the line between their ends.
fn corners<'a>(outline: &Outline<'a>) -> Option<Vec<(Node<'a>, Point)>> {
    let mut kind = None;
    let mut points: Vec<(Node<'a>, Point)> = Vec::new();
    for Corner { kind: of, point } in outline.corners() {
        if *kind.get_or_insert(of) != of {
            return None;
        }
        let place = match of {
            CornerKind::Road => Point::finite(point.s()?, point.t()?),
            CornerKind::Local => Point::finite(point.u()?, point.v()?),
            CornerKind::Curve => None,
        }?;
        // A repeated corner makes no side.
        if points
            .last()
            .is_none_or(|(_, last)| last.distance(place) > 1e-9)
        {
            points.push((point.node(), place));
        }
    }
    let closes = points.len() > 1
        && points
            .first()
            .zip(points.last())
            .is_some_and(|(first, last)| first.1.distance(last.1) < 1e-9);
    if closes {
        points.pop();
    }
    Some(points)
}

/// Checks whether the corners stand above each other. In the plan view, a frame over the road is a
/// line there and back. Its sides cross if its legs lean.
fn is_upright(corners: &[(Node<'_>, Point)]) -> bool {
    let height = |node: &Node<'_>| {
        let name = if node.is("cornerRoad") { "dz" } else { "z" };
        node.f64(name).unwrap_or(0.0)
    };
    let heights = || corners.iter().map(|(node, _)| height(node));
    let least = heights().fold(f64::INFINITY, f64::min);
    let most = heights().fold(f64::NEG_INFINITY, f64::max);
    // An upright outline is higher than its width across its longest side.
    let next = corners.iter().cycle().skip(1);
    let sides = corners.iter().zip(next).map(|(one, next)| (one.1, next.1));
    let lengths = sides.map(|(from, to)| (from.distance(to), from, to));
    let Some((longest, from, to)) = lengths.max_by(|one, other| one.0.total_cmp(&other.0)) else {
        return false;
    };
    let off = |point: Point| {
        ((to.x - from.x) * (point.y - from.y) - (to.y - from.y) * (point.x - from.x)) / longest
    };
    let off = || corners.iter().map(|one| off(one.1));
    let width = off().fold(f64::NEG_INFINITY, f64::max) - off().fold(f64::INFINITY, f64::min);
    most - least > width
}

/// Checks whether two sides cross, each by more than the rounding on both sides of the other. Marks
/// that are lines without width go there and back.
fn cross([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    divides([a, b], [c, d]) && divides([c, d], [a, b])
}

/// Checks whether two points lie clearly on different sides of the line through two others.
fn divides([a, b]: [Point; 2], [c, d]: [Point; 2]) -> bool {
    let (x, y) = (b.x - a.x, b.y - a.y);
    let length = x.hypot(y);
    let off = |point: Point| (x * (point.y - a.y) - y * (point.x - a.x)) / length;
    let (one, other) = (off(c), off(d));
    one.min(other) < -ROUNDING && one.max(other) > ROUNDING
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[TOLERANCE],
    run,
    ..Rule::after(READABLE)
};

const TOLERANCE: Param = Param::number(
    "tolerance",
    10.0,
    "m",
    "maximum distance by which reference lines may extend beyond the bounds",
);

/// Function for the distance of a point beyond a bound, negative within.
type Beyond = fn(Point, f64) -> f64;

/// One of the four bounds, with the point that lies farthest beyond it.
struct Bound {
    name: &'static str,
    value: f64,
    beyond: Beyond,
    farthest: Option<(f64, Point)>,
}

const BOUNDS: [(&str, Beyond); 4] = [
    ("north", |point, bound| point.y - bound),
    ("south", |point, bound| bound - point.y),
    ("east", |point, bound| point.x - bound),
    ("west", |point, bound| bound - point.x),
];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let tolerance = found.number(&TOLERANCE);
    let Some(header) = map.header() else { return };
    let Some(mut bounds) = bounds(header) else {
        return;
    };
    let geometries = map
        .roads()
        .iter()
        .flat_map(|road| road.plan_view().geometries());
    let mut is_any_within = false;
    for geometry in geometries {
        is_any_within |= look(geometry, tolerance, &mut bounds);
    }
    let farthest = |bound: &Bound| bound.farthest.map_or(0.0, |(beyond, _)| beyond);
    let mut beyond: Vec<&Bound> = bounds.iter().filter(|it| it.farthest.is_some()).collect();
    beyond.sort_by(|a, b| farthest(b).total_cmp(&farthest(a)));
    let Some((worst, point)) = beyond.first().and_then(|it| Some((*it, it.farthest?.1))) else {
        return;
    };
    let sides: Vec<String> = beyond
        .iter()
        .map(|bound| {
            format!(
                "{:.1} m beyond `{}` = {}",
                farthest(bound),
                bound.name,
                rounded(bound.value)
            )
        })
        .collect();
    let text = if is_any_within {
        format!(
            "the roads extend beyond the header's bounds, {}; the bounds must contain all roads (tolerance \
             {tolerance} m)",
            sides.join(", ")
        )
    } else {
        format!(
            "no road begins or ends within the header's bounds; the roads extend {}; the bounds must contain all \
             roads, in the same coordinates",
            sides.join(", ")
        )
    };
    found
        .issue(Place::attribute_or_node(header, worst.name), text)
        .point(point.x, point.y, 0.0)
        .here("the bound, and the point farthest beyond it");
}

/// Rounds to the millimetre and removes the sign of zero.
fn rounded(value: f64) -> f64 {
    (value * 1000.0).round() / 1000.0 + 0.0
}

/// Returns the bounds with information. Many programs write zeros for missing bounds, so these are
/// ignored. A reversed pair gives `None`, because another rule reports it.
fn bounds(header: Node<'_>) -> Option<Vec<Bound>> {
    let value = |name| header.f64(name).ok().filter(|number| number.is_finite());
    let mut all = Vec::new();
    for (pair, names) in [("north", "south"), ("east", "west")]
        .into_iter()
        .zip(BOUNDS.chunks(2))
    {
        let (most, least) = (value(pair.0), value(pair.1));
        if (most, least) == (Some(0.0), Some(0.0)) {
            continue;
        }
        if most.zip(least).is_some_and(|(most, least)| most < least) {
            return None;
        }
        for ((name, beyond), value) in names.iter().zip([most, least]) {
            all.extend(value.map(|value| Bound {
                name,
                value,
                beyond: *beyond,
                farthest: None,
            }));
        }
    }
    Some(all)
}

/// Records points beyond the bounds. Returns whether any part of a geometry lies within them.
fn look(geometry: &Geometry<'_>, tolerance: f64, bounds: &mut [Bound]) -> bool {
    let Some(start) = geometry.start_point() else {
        return false;
    };
    let length = geometry.length().unwrap_or(0.0).abs();
    let beyond = |bound: &Bound| (bound.beyond)(start, bound.value);
    // The distance of any point of a curve from its start is at most its length.
    if bounds
        .iter()
        .all(|bound| beyond(bound) + length <= tolerance)
    {
        return true;
    }
    let steps: &[f64] = match geometry.kind() {
        Some(ShapeKind::Line) => &[0.0, 1.0],
        _ => &[0.0, 0.25, 0.5, 0.75, 1.0],
    };
    let mut is_any_within = false;
    for step in steps {
        let Some(pose) = geometry.pose(length * step) else {
            continue;
        };
        let mut is_within = true;
        for bound in &mut *bounds {
            let beyond = (bound.beyond)(pose.point(), bound.value);
            is_within &= beyond <= tolerance;
            let least = bound.farthest.map_or(tolerance, |(beyond, _)| beyond);
            if beyond > least {
                bound.farthest = Some((beyond, pose.point()));
            }
        }
        is_any_within |= is_within;
    }
    is_any_within
}

use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    versions: "1.7.0..",
    backport: Backport::Lower { since: "1.6.0" },
    params: &[LIMIT],
    run,
    ..Rule::after(READABLE)
};

const LIMIT: Param = Param::number("limit", 1e5, "m", "maximum accepted coordinate");

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let limit = found.number(&LIMIT);
    let geometries = map
        .roads()
        .iter()
        .flat_map(|road| road.plan_view().geometries());
    let points: Vec<_> = geometries
        .filter_map(|geometry| geometry.origin())
        .collect();
    let (Some(header), Some(first)) = (map.header(), points.first()) else {
        return;
    };
    let (mut low, mut high) = (*first, *first);
    for point in &points {
        (low.x, low.y) = (low.x.min(point.x), low.y.min(point.y));
        (high.x, high.y) = (high.x.max(point.x), high.y.max(point.y));
    }
    let largest = |point: &Point| point.x.abs().max(point.y.abs());
    let Some(farthest) = points
        .iter()
        .max_by(|a, b| largest(a).total_cmp(&largest(b)))
    else {
        return;
    };
    let (x, y) = ((low.x + high.x) / 2.0, (low.y + high.y) / 2.0);
    let extent = (high.x - low.x).max(high.y - low.y) / 2.0;
    // A map that is large itself cannot be centered better.
    if largest(farthest) <= limit || extent > largest(farthest) / 2.0 {
        return;
    }
    let place = header.child("offset").unwrap_or(header);
    let text = format!(
        "the roads lie around x = {x:.0}, y = {y:.0}, with coordinates up to {:.0} m; they should lie around (0, \
         0), with the distance in `offset` (at most {limit} m is accepted)",
        largest(farthest)
    );
    found
        .issue(place, text)
        .point(farthest.x, farthest.y, 0.0)
        .here("the element for the distance");
}

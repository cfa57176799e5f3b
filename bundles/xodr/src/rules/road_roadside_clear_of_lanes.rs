use crate::families::object_parts::{has_outline, named, number};
use crate::families::on_road::{OnRoad, lane_name};
use crate::families::roadside::{Row, Spot, lane_at, lanes_at, place, stands_itself, things};
use crate::families::routes::DIRECTED;
use crate::prelude::*;

pub const RULE: Rule<Roads> = Rule {
    level: Level::Warning,
    params: &[DEPTH, CLEARANCE],
    each: Some(each),
    ..Rule::after(READABLE)
};

const DEPTH: Param = Param::number(
    "depth",
    0.5,
    "m",
    "largest distance inside a lane at which an object does not block the lane",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    2.0,
    "m",
    "height above the road from which vehicles can pass below an object",
);

/// Types that never stand on a lane. Barriers, obstacles and patches may be intended there.
const FIXED: [&str; 5] = ["pole", "tree", "vegetation", "streetLamp", "building"];

fn each(map: &RoadMap<'_>, part: &Part, found: &mut Sink<'_>) {
    for road in map.part(part).roads() {
        for thing in things(road) {
            let kind = thing.attr("type");
            if kind == Some("parkingSpace") {
                parking(road, thing, found);
            } else if thing.is("object") && kind.is_some_and(|kind| FIXED.contains(&kind)) {
                object(road, thing, found);
            } else if thing.is("signal") {
                sign(road, thing, found);
            }
        }
        for object in road.objects() {
            for repeat in object.repeats() {
                row(road, object.node(), repeat.node(), found);
            }
        }
    }
}

/// Reports repeated objects: copies in a lane, or a row across all lanes.
fn row(road: &Road<'_>, object: Node<'_>, repeat: Node<'_>, found: &mut Sink<'_>) {
    let kind = object.attr("type").unwrap_or_default();
    let fixed = FIXED.contains(&kind);
    let Some(row) = Row::of(repeat, road).filter(|_| fixed || kind == "barrier") else {
        return;
    };
    if has_outline(object)
        || object.child("skeleton").is_some()
        || !is_in_the_way(repeat, ["zOffsetStart", "heightStart"], object, found)
        || !is_in_the_way(repeat, ["zOffsetEnd", "heightEnd"], object, found)
    {
        return;
    }
    if row.distance.is_some() {
        if fixed {
            copies(road, object, repeat, &row, found);
        }
    } else if !row.is_straight {
        crossing(road, object, repeat, &row, found);
    }
}

fn copies(road: &Road<'_>, object: Node<'_>, repeat: Node<'_>, row: &Row, found: &mut Sink<'_>) {
    let depth = found.number(&DEPTH);
    let mut hits = row
        .copies()
        .filter_map(|(s, t)| Some((s, t, blocked(road, s, t, depth)?)));
    let Some((s, t, spot)) = hits.next() else {
        return;
    };
    let text = format!(
        "a copy of {} of type `{}` stands inside {} at s = {s:.1}, {:.2} m from its border; copies are placed \
         from `tStart` to `tEnd` of `repeat`, which should lie beside the lane",
        named(object),
        object.attr("type").unwrap_or_default(),
        lane_name(spot.lane),
        spot.depth
    );
    found
        .issue(Place::attribute_or_node(repeat, "tStart"), text)
        .on(road, s, t)
        .at(spot.lane.node(), "the lane");
}

/// Reports a continuous row along the road that crosses from one side of all driving lanes to the
/// other.
fn crossing(road: &Road<'_>, object: Node<'_>, repeat: Node<'_>, row: &Row, found: &mut Sink<'_>) {
    let [(s, from), (end, to)] = row.ends;
    if end - s < (to - from).abs() {
        return;
    }
    let lanes = lanes_at(road, s, &DIRECTED).zip(lanes_at(road, end, &DIRECTED));
    let Some(([right, left], [end_right, end_left])) = lanes else {
        return;
    };
    let is_one = |[right, left]: [f64; 2]| left - right > 2.0 * found.number(&DEPTH);
    if !is_one([right, left]) || !is_one([end_right, end_left]) {
        return;
    }
    let to_right = from >= left && to <= end_right;
    let to_left = from <= right && to >= end_left;
    if !(to_right || to_left) {
        return;
    }
    let text = format!(
        "{} of type `{}` runs from t = {from} at s = {s:.1} to t = {to} at s = {end:.1}, across all driving \
         lanes of road `{}`; an object along a road should stay on one side of its driving lanes",
        named(object),
        object.attr("type").unwrap_or_default(),
        road.id()
    );
    found
        .issue(Place::attribute_or_node(repeat, "tEnd"), text)
        .on(road, end, to);
}

/// Checks whether a repeated object is neither flat nor above the vehicles at one of its ends.
fn is_in_the_way(
    repeat: Node<'_>,
    [up, high]: [&str; 2],
    object: Node<'_>,
    found: &Sink<'_>,
) -> bool {
    let low = number(repeat, up).or_else(|| number(object, "zOffset"));
    let low = low.unwrap_or(0.0);
    let height = number(repeat, high).or_else(|| number(object, "height"));
    low <= found.number(&CLEARANCE) && !height.is_some_and(|height| low + height < FLAT)
}

/// Height above the road in metres below which an object is flat.
const FLAT: f64 = 0.3;

/// Returns the lane that is blocked at this position.
fn blocked<'m, 'a>(road: &'m Road<'a>, s: f64, t: f64, depth: f64) -> Option<Spot<'m, 'a>> {
    let spot = lane_at(road, s, t).filter(|spot| spot.depth > depth)?;
    is_directed(spot.lane).then_some(spot)
}

fn is_directed(lane: LaneRef<'_, '_>) -> bool {
    lane.kind().is_some_and(|kind| DIRECTED.contains(&kind))
}

/// Returns the driving lane next to a position that lies on the line between two of them, at least
/// `depth` metres inside both.
fn between<'m, 'a>(road: &'m Road<'a>, s: f64, t: f64, depth: f64) -> Option<Spot<'m, 'a>> {
    // The position itself is less than `depth` metres away from a border.
    let beside = [t - 2.0 * depth, t + 2.0 * depth].map(|t| lane_at(road, s, t));
    let [Some(right), Some(left)] = beside else {
        return None;
    };
    // A narrow lane between them, such as a median, has an id of its own.
    let touch = match right.lane.id().zip(left.lane.id()) {
        Some((-1, 1)) => true,
        Some((right, left)) => left - right == 1 && right != 0 && left != 0,
        None => false,
    };
    (touch && is_directed(right.lane) && is_directed(left.lane)).then_some(Spot {
        lane: right.lane,
        depth: 0.0,
    })
}

fn object(road: &Road<'_>, node: Node<'_>, found: &mut Sink<'_>) {
    let low = number(node, "zOffset").unwrap_or(0.0);
    let height = number(node, "height");
    let is_flat = height.is_some_and(|height| low + height < FLAT);
    if low > found.number(&CLEARANCE)
        || is_flat
        || has_outline(node)
        || node.child("skeleton").is_some()
        || is_on_island(road, node)
    {
        return;
    }
    report(road, node, "should stand beside the lane", found);
}

/// Checks whether an object stands on a traffic island.
fn is_on_island(road: &Road<'_>, node: Node<'_>) -> bool {
    let Some((s, t)) = place(node, road) else {
        return false;
    };
    road.objects().any(|object| {
        let island = object.node();
        let is_island = island.attr("type") == Some("trafficIsland");
        let Some((at, beside)) = place(island, road).filter(|_| is_island) else {
            return false;
        };
        // The size of an outline is not needed: islands are small.
        let half = |name: &str| number(island, name).unwrap_or(LARGEST_ISLAND) / 2.0;
        (s - at).abs() <= half("length") && (t - beside).abs() <= half("width")
    })
}

/// Size in metres of an island that does not state its own.
const LARGEST_ISLAND: f64 = 10.0;

fn parking(road: &Road<'_>, node: Node<'_>, found: &mut Sink<'_>) {
    if !has_outline(node) {
        report(
            road,
            node,
            "should lie beside the lane or on a lane for parking",
            found,
        );
    }
}

/// Reports a sign on its own post in a lane. It ignores signs that hang over the lane or are
/// painted on it. Signs without a position are put on the reference line, so it ignores that too.
/// Lights are never painted.
fn sign(road: &Road<'_>, node: Node<'_>, found: &mut Sink<'_>) {
    let height = number(node, "zOffset").unwrap_or(0.0);
    let in_the_way = match node.attr("dynamic") {
        Some("no") => (1.0..=3.0).contains(&height),
        Some("yes") => height <= 3.0,
        _ => false,
    };
    let anywhere = || number(node, "t").is_some_and(|t| t.abs() < 1e-6);
    if in_the_way && !anywhere() {
        report(road, node, "should stand beside the lane", found);
    }
}

fn report(road: &Road<'_>, node: Node<'_>, should: &str, found: &mut Sink<'_>) {
    let depth = found.number(&DEPTH);
    let Some(origin) = place(node, road).filter(|_| stands_itself(node)) else {
        return;
    };
    let on_road = |s: f64| {
        road.length()
            .is_some_and(|length| (0.0..=length).contains(&s))
    };
    let corners = corners(node, origin).filter(|(s, _)| on_road(*s));
    let places = std::iter::once(origin).chain(corners);
    let mut hits = places.filter_map(|(s, t)| Some((s, t, blocked(road, s, t, depth)?)));
    let Some((s, t, spot)) = hits.next() else {
        on_the_line(road, node, origin, should, found);
        return;
    };
    let part = if (s, t) == origin {
        "stands inside"
    } else {
        "has a corner inside"
    };
    let text = format!(
        "{} of type `{}` {part} {}, {:.2} m from its border; it {should}",
        named(node),
        node.attr("type").unwrap_or_default(),
        lane_name(spot.lane),
        spot.depth
    );
    found
        .issue(Place::attribute_or_node(node, "t"), text)
        .on(road, s, t)
        .at(spot.lane.node(), "the lane");
}

/// Reports a fixed object on the line between two driving lanes.
fn on_the_line(
    road: &Road<'_>,
    node: Node<'_>,
    (s, t): (f64, f64),
    should: &str,
    found: &mut Sink<'_>,
) {
    let kind = node.attr("type").unwrap_or_default();
    if !(node.is("object") && FIXED.contains(&kind)) {
        return;
    }
    let Some(spot) = between(road, s, t, found.number(&DEPTH)) else {
        return;
    };
    let text = format!(
        "{} of type `{kind}` stands on the border of {}, between two driving lanes; it {should}",
        named(node),
        lane_name(spot.lane)
    );
    found
        .issue(Place::attribute_or_node(node, "t"), text)
        .on(road, s, t)
        .at(spot.lane.node(), "the lane");
}

/// Returns the corners of a building's box in s and t, as if the road were straight there.
fn corners(node: Node<'_>, (s, t): (f64, f64)) -> impl Iterator<Item = (f64, f64)> {
    let size = number(node, "length").zip(number(node, "width"));
    let size = size.filter(|_| node.attr("type") == Some("building"));
    let (sin, cos) = number(node, "hdg").unwrap_or(0.0).sin_cos();
    size.into_iter().flat_map(move |(length, width)| {
        let signs = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        signs.map(|(u, v)| {
            let (u, v) = (u * length, v * width);
            (s + u * cos - v * sin, t + u * sin + v * cos)
        })
    })
}

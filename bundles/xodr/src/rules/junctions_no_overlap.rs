use std::cell::OnceCell;
use std::collections::BTreeSet;

use crate::families::junction_area::{boundary, ring};
use crate::families::polygons::{contains, distance_to_boundary, sides};
use crate::families::strips::{Patch, area, common, middle, strip, traffic_edges};
use crate::prelude::*;

const AREA: Param = Param::number(
    "area",
    1.0,
    "m²",
    "maximum accepted common area of roads of two junctions",
);
const DEPTH: Param = Param::number(
    "depth",
    0.1,
    "m",
    "maximum distance by which the boundary of one junction may extend into that of another",
);
const CLEARANCE: Param = Param::number(
    "clearance",
    3.0,
    "m",
    "height difference from which junctions lie over each other",
);

/// Length of the compared pieces of roads, and inward shift of their edges, in metres.
const STEP: f64 = 2.0;
const SHRINK: f64 = 0.05;

/// Tolerance of the clearance in metres. Smaller differences count as sufficient clearance.
const SAME: f64 = 1e-6;

/// Maximum numbers of compared pairs, and of points along a straight side of a boundary.
const BUDGET: usize = 10_000_000;
const MOST_POINTS: f64 = 64.0;

pub const RULE: Rule<Roads> = Rule {
    versions: "1.1.0..",
    params: &[AREA, DEPTH, CLEARANCE],
    run,
    ..Rule::after(READABLE)
};

/// Ground that a junction covers: its boundary, or one of its roads.
struct Footprint<'m, 'a> {
    junction: &'m Junction<'a>,
    shape: Shape<'m, 'a>,
    extent: Extent,
    /// Minimum and maximum height, if known.
    heights: [f64; 2],
    pieces: OnceCell<Vec<Patch>>,
}

enum Shape<'m, 'a> {
    Ring(Vec<Point>),
    Road {
        road: &'m Road<'a>,
        /// Whether the junction has a boundary, which is compared with other boundaries instead.
        bounded: bool,
    },
}

/// Minimum and maximum of x, then of y.
type Extent = [f64; 4];

fn run(map: &RoadMap<'_>, found: &mut Sink<'_>) {
    let mut footprints = footprints(map);
    // Along the longer side of the map, fewer footprints overlap in their extents.
    let whole = footprints
        .iter()
        .fold(NOWHERE, |all, one| joined(all, one.extent));
    let axis = if whole[1] - whole[0] >= whole[3] - whole[2] {
        0
    } else {
        2
    };
    footprints.sort_by(|one, other| one.extent[axis].total_cmp(&other.extent[axis]));
    let (mut budget, mut told) = (BUDGET, BTreeSet::new());
    for (at, one) in footprints.iter().enumerate() {
        let beside = footprints[at + 1..].iter();
        for other in beside.take_while(|other| other.extent[axis] <= one.extent[axis + 1]) {
            budget = budget.saturating_sub(1);
            if budget == 0 {
                return;
            }
            let (one, other) = if one.junction.index() < other.junction.index() {
                (one, other)
            } else {
                (other, one)
            };
            let pair = (one.junction.index(), other.junction.index());
            if one.junction.id() != other.junction.id()
                && meet(one.extent, other.extent)
                && !told.contains(&pair)
                && check(one, other, &mut budget, found)
            {
                told.insert(pair);
            }
        }
    }
}

const NOWHERE: Extent = [
    f64::INFINITY,
    f64::NEG_INFINITY,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

fn joined(one: Extent, other: Extent) -> Extent {
    [
        one[0].min(other[0]),
        one[1].max(other[1]),
        one[2].min(other[2]),
        one[3].max(other[3]),
    ]
}

fn meet(one: Extent, other: Extent) -> bool {
    one[0] <= other[1] && other[0] <= one[1] && one[2] <= other[3] && other[2] <= one[3]
}

fn footprints<'m, 'a>(map: &'m RoadMap<'a>) -> Vec<Footprint<'m, 'a>> {
    let mut footprints = Vec::new();
    let mut bounded: Vec<Option<[f64; 2]>> = vec![None; map.junctions().len()];
    let rings: Vec<_> = map
        .junctions()
        .iter()
        .map(|junction| boundary(map, junction).map(|stretches| ring(&stretches)))
        .collect();
    for road in map.roads() {
        let Some(junction) = map.junction_of(road) else {
            continue;
        };
        let height = road.elevation().at_or_zero(0.0);
        let ring = rings.get(junction.index()).and_then(Option::as_ref);
        if let (Some(_), Some(slot)) = (ring, bounded.get_mut(junction.index())) {
            let [low, high] = slot.unwrap_or([f64::INFINITY, f64::NEG_INFINITY]);
            *slot = height
                .map(|height| [low.min(height), high.max(height)])
                .or(*slot);
        }
        if let Some(extent) = reach(road) {
            let height = height.unwrap_or(0.0);
            footprints.push(Footprint {
                junction,
                shape: Shape::Road {
                    road,
                    bounded: ring.is_some(),
                },
                extent,
                heights: [height, height],
                pieces: OnceCell::new(),
            });
        }
    }
    for ((junction, ring), heights) in map.junctions().iter().zip(rings).zip(bounded) {
        let Some(ring) = ring else { continue };
        let points = ring
            .iter()
            .map(|point| [point.x, point.x, point.y, point.y]);
        footprints.push(Footprint {
            junction,
            extent: points.fold(NOWHERE, joined),
            shape: Shape::Ring(ring),
            heights: heights.unwrap_or([0.0, 0.0]),
            pieces: OnceCell::new(),
        });
    }
    footprints
}

/// Returns a box around a road. A point's distances to both ends add up to at most the length.
fn reach(road: &Road<'_>) -> Option<Extent> {
    let length = road.length().filter(|length| *length > 0.0)?;
    let [start, end] = [road.pose(0.0)?, road.pose(Station::before(length))?];
    let edges =
        [Station::at(0.0), Station::before(length)].map(|station| traffic_edges(road, station));
    let width = edges
        .into_iter()
        .flatten()
        .fold(0.0_f64, |widest, (right, left)| {
            widest.max(right.abs()).max(left.abs())
        });
    let around = 0.5 * length + width + 1.0;
    let (x, y) = (0.5 * (start.x + end.x), 0.5 * (start.y + end.y));
    Some([x - around, x + around, y - around, y + around])
}

/// Reports two footprints if they overlap. Returns whether they do.
fn check(
    one: &Footprint<'_, '_>,
    other: &Footprint<'_, '_>,
    budget: &mut usize,
    found: &mut Sink<'_>,
) -> bool {
    let clearance = found.number(&CLEARANCE);
    let apart = (one.heights[0] - other.heights[1]).max(other.heights[0] - one.heights[1]);
    match (&one.shape, &other.shape) {
        (Shape::Ring(_), Shape::Ring(_)) if apart >= clearance - SAME => false,
        (Shape::Ring(here), Shape::Ring(there)) => {
            let deepest = deepest(here, there).filter(|(deep, _)| *deep > found.number(&DEPTH));
            let Some((deep, point)) = deepest else {
                return false;
            };
            let text = format!(
                "the boundaries of junctions `{}` and `{}` overlap by {deep:.2} m; the areas of junctions must \
                 not overlap",
                one.junction.id(),
                other.junction.id()
            );
            found
                .issue(other.junction.node(), text)
                .point(point.x, point.y, 0.0)
                .at(one.junction.node(), "the other junction");
            true
        }
        (
            Shape::Road {
                road: here,
                bounded,
            },
            Shape::Road {
                road: there,
                bounded: also,
            },
        ) if !(*bounded && *also) => roads_overlap((one, here), (other, there), budget, found),
        _ => false,
    }
}

/// Returns the point of either ring that lies deepest inside the other one.
fn deepest(one: &[Point], other: &[Point]) -> Option<(f64, Point)> {
    let inside = |points: &[Point], ring: &[Point]| {
        let inner = fine(points)
            .filter(|point| contains(ring, *point))
            .map(|point| (distance_to_boundary(point, ring), point));
        inner.max_by(|one, other| one.0.total_cmp(&other.0))
    };
    let both = [inside(one, other), inside(other, one)];
    both.into_iter()
        .flatten()
        .max_by(|one, other| one.0.total_cmp(&other.0))
}

/// Returns the points of a ring, with additional points along its straight sides.
fn fine(ring: &[Point]) -> impl Iterator<Item = Point> {
    sides(ring).flat_map(|(one, other)| {
        let count = one.distance(other).ceil().clamp(1.0, MOST_POINTS);
        (0..count as usize).map(move |index| {
            let share = index as f64 / count;
            Point {
                x: one.x + share * (other.x - one.x),
                y: one.y + share * (other.y - one.y),
            }
        })
    })
}

/// Returns the pieces of a road.
fn pieces(road: &Road<'_>) -> Vec<Patch> {
    let range = [0.0, road.length().unwrap_or(0.0)];
    strip(road, range, STEP, SHRINK, |station| {
        traffic_edges(road, station)
    })
}

fn roads_overlap(
    (one, a): (&Footprint<'_, '_>, &Road<'_>),
    (other, b): (&Footprint<'_, '_>, &Road<'_>),
    budget: &mut usize,
    found: &mut Sink<'_>,
) -> bool {
    let ones = one.pieces.get_or_init(|| pieces(a));
    let others = other.pieces.get_or_init(|| pieces(b));
    *budget = budget.saturating_sub(ones.len() * others.len());
    let clearance = found.number(&CLEARANCE);
    let mut total = 0.0;
    let mut place = None;
    for here in ones {
        for there in others {
            let Some(shape) = common(&here.corners, &there.corners) else {
                continue;
            };
            let heights = [
                a.elevation().at_or_zero(here.from),
                b.elevation().at_or_zero(there.from),
            ];
            if matches!(heights, [Some(one), Some(other)] if (one - other).abs() < clearance - SAME)
            {
                total += area(&shape);
                place = place.or_else(|| Some((middle(&shape)?, here.from, there.from)));
            }
        }
    }
    let Some((point, s, at)) = place.filter(|_| total > found.number(&AREA)) else {
        return false;
    };
    let text = format!(
        "junctions `{}` and `{}` overlap: their roads `{}` around s = {s:.1} and `{}` around s = {at:.1} cover the \
         same ground ({total:.1} m²); the areas of junctions must not overlap",
        one.junction.id(),
        other.junction.id(),
        a.id(),
        b.id()
    );
    found
        .issue(other.junction.node(), text)
        .level(Level::Warning)
        .point(point.x, point.y, 0.0)
        .at(one.junction.node(), "the other junction")
        .at(a.node(), "the first road")
        .at(b.node(), "the second road");
    true
}

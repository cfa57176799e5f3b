//! Which roads cover the same ground (OpenDRIVE 1.9, 10.1).
//!
//! Roads are cut into pieces a few metres long: quadrangles as wide as the lanes for vehicles.
//! A grid tells which pieces may overlap; the work is bounded, whatever the map says.

use std::collections::hash_map::Entry;

use foldhash::HashMap;
use qcbus_opendrive::geometry::Point;
use qcbus_opendrive::{LaneLayer, LaneRef, Road, RoadMap, SectionRef, Side, Station};

use super::driving::is_drivable;

/// Length of a piece, in metres; more on maps with more than [`MOST_PIECES`] of them.
const STEP: f64 = 5.0;
const MOST_PIECES: f64 = 400_000.0;

/// Heights that differ from the clearance by less, in metres, keep it.
const SAME: f64 = 1e-6;

/// Size of a cell of the grid, in metres, and the greatest number of cells that a piece may touch.
const CELL: f64 = 10.0;
const MOST_CELLS: f64 = 400.0;

/// A piece of a road.
pub(crate) struct Slice {
    pub road: usize,
    /// Where it begins and ends, in metres.
    pub from: f64,
    pub to: f64,
    pub width: f64,
    z: f64,
    corners: [Point; 4],
    bounds: Bounds,
}

/// The rectangle around a piece: the least and the greatest x, then y.
#[derive(Clone, Copy)]
struct Bounds([f64; 2], [f64; 2]);

impl Bounds {
    fn of(corners: &[Point; 4]) -> Bounds {
        let range = |part: fn(&Point) -> f64| {
            let values = corners.iter().map(part);
            let low = values.clone().fold(f64::INFINITY, f64::min);
            [low, values.fold(f64::NEG_INFINITY, f64::max)]
        };
        Bounds(range(|point| point.x), range(|point| point.y))
    }

    fn meets(&self, other: &Bounds) -> bool {
        let meets = |one: [f64; 2], other: [f64; 2]| one[0] <= other[1] && other[0] <= one[1];
        meets(self.0, other.0) && meets(self.1, other.1)
    }
}

/// A place where two roads cover the same ground, named by the two pieces that share most of it.
pub(crate) struct Overlap<'p> {
    pub one: &'p Slice,
    pub other: &'p Slice,
    /// In square metres, of the whole place.
    pub area: f64,
    /// A point that both cover.
    pub point: Point,
    pub z: f64,
}

/// What counts as an overlap.
pub(crate) struct Limits {
    /// Least area, in square metres.
    pub area: f64,
    /// By how much either edge is moved inward, in metres.
    pub shrink: f64,
    /// Roads that are so far apart in height, in metres, lie over each other.
    pub clearance: f64,
}

/// The pieces of all roads.
pub(crate) fn slices(map: &RoadMap<'_>, limits: &Limits) -> Vec<Slice> {
    let lengths = map.roads().iter().filter_map(Road::length);
    let total: f64 = lengths.filter(|length| *length > 0.0).sum();
    let step = STEP.max(total / MOST_PIECES);
    let mut slices = Vec::new();
    for road in map.roads() {
        let Some(length) = road.length().filter(|length| *length > 0.0) else {
            continue;
        };
        let count = (length / step).ceil().clamp(1.0, MOST_PIECES) as usize;
        let at = |index: usize| length * index as f64 / count as f64;
        let Some(layer) = road.permanent() else {
            continue;
        };
        let lanes: Vec<[Vec<bool>; 2]> = layer.sections(road).map(travelled).collect();
        let edge = |station| edge(road, layer, &lanes, station, limits);
        let mut before = edge(Station::at(0.0));
        for index in 0..count {
            let after = edge(Station::before(at(index + 1)));
            if let (Some(start), Some(end)) = (before, after) {
                slices.extend(slice(road, [at(index), at(index + 1)], start, end));
            }
            before = after;
        }
    }
    slices
}

/// Whether vehicles travel along a lane: on those of annex D but hard shoulders, edges and the like,
/// which neighbouring roads share at times.
fn is_travelled(lane: LaneRef<'_, '_>) -> bool {
    let aside = matches!(lane.kind(), Some("border" | "stop" | "restricted"));
    is_drivable(lane) && !aside
}

/// Which lanes of a section are for vehicles, left and right, outward up to the last that is.
fn travelled(section: SectionRef<'_, '_>) -> [Vec<bool>; 2] {
    Side::BOTH.map(|side| {
        let mut lanes: Vec<bool> = section.side(side).map(is_travelled).collect();
        lanes.truncate(
            lanes
                .iter()
                .rposition(|lane| *lane)
                .map_or(0, |last| last + 1),
        );
        lanes
    })
}

/// The left and the right end of the lanes for vehicles at s, and the elevation. `lanes` are those
/// of each section of the layer.
fn edge<'a>(
    road: &Road<'a>,
    layer: &LaneLayer<'a>,
    lanes: &[[Vec<bool>; 2]],
    s: Station,
    limits: &Limits,
) -> Option<(Point, Point, f64)> {
    let mut extent: Option<(f64, f64)> = None;
    for (slot, side) in Side::BOTH.into_iter().enumerate() {
        let Some(section) = layer.section_at(road, side, s) else {
            continue;
        };
        let of_vehicles = &lanes.get(section.index())?[slot];
        if of_vehicles.is_empty() {
            continue;
        }
        let spans = section.each_span(side, s.shifted(-section.s()?));
        for (is_for_vehicles, span) in of_vehicles.iter().zip(spans) {
            if *is_for_vehicles {
                let (low, high) = extent.unwrap_or((f64::INFINITY, f64::NEG_INFINITY));
                let (one, other) = (span.inner.min(span.outer), span.inner.max(span.outer));
                extent = Some((low.min(one), high.max(other)));
            }
        }
    }
    let (right, left) = extent.map(|(low, high)| (low + limits.shrink, high - limits.shrink))?;
    let pose = road.pose(s)?;
    let proper = left - right > 0.1;
    let (sin, cos) = pose.hdg.sin_cos();
    let beside = |t: f64| Point::finite(pose.x - sin * t, pose.y + cos * t);
    proper.then_some((
        beside(left)?,
        beside(right)?,
        road.elevation().at_or_zero(s)?,
    ))
}

fn slice(
    road: &Road<'_>,
    [from, to]: [f64; 2],
    start: (Point, Point, f64),
    end: (Point, Point, f64),
) -> Option<Slice> {
    let corners = [start.1, end.1, end.0, start.0];
    let slice = Slice {
        road: road.index(),
        from,
        to,
        width: start.0.distance(start.1).max(end.0.distance(end.1)),
        z: 0.5 * (start.2 + end.2),
        corners,
        bounds: Bounds::of(&corners),
    };
    // Where a border turns back the corners are not in order, and nothing can be said.
    let convex = (0..4).all(|at| {
        let [a, b, c] = [0, 1, 2].map(|next| corners[(at + next) % 4]);
        turn(a, b, c) > 0.0
    });
    convex.then_some(slice)
}

/// Twice the signed area of a triangle.
pub(crate) fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)
}

/// Calls `found` with the places where two roads, or two parts of one, cover the same ground: one for each
/// pair and place, if two pieces that `wanted` accepts share more than the least area there. The pieces
/// are those that share most, the area is that of the whole place.
pub(crate) fn overlaps<'p>(
    slices: &'p [Slice],
    limits: &Limits,
    wanted: impl Fn(&Slice, &Slice) -> bool,
    found: impl FnMut(Overlap<'p>),
) {
    let mut cells = Cells::default();
    let mut spots = Spots::default();
    // Enough for every map that is one; pieces heaped up at one place are not compared for ever.
    let mut budget = 10_000_000 + 100 * slices.len();
    'all: for (one, at) in slices.iter().zip(0_u32..) {
        for cell in cells_of(one) {
            let here = cells.put(cell, at);
            for other in here.filter_map(|other| slices.get(other as usize)) {
                budget = budget.saturating_sub(1);
                if budget == 0 {
                    break 'all;
                }
                let level = (one.z - other.z).abs() < limits.clearance - SAME;
                let near = level && one.bounds.meets(&other.bounds);
                // Pieces that share several cells are met in the first of them only.
                if near && first_common(one, other) == cell && wanted(other, one) {
                    budget = budget.saturating_sub(COMPARED);
                    if let Some((area, point)) = common(one, other) {
                        spots.put(other, one, area, point);
                    }
                }
            }
        }
    }
    spots.tell(limits, found);
}

/// How many pairs of pieces may be met in the time in which one is compared.
const COMPARED: usize = 8;

/// The first cell that two pieces share whose rectangles meet.
fn first_common(one: &Slice, other: &Slice) -> (i64, i64) {
    let first = |one: [f64; 2], other: [f64; 2]| (one[0].max(other[0]) / CELL).floor() as i64;
    (
        first(one.bounds.0, other.bounds.0),
        first(one.bounds.1, other.bounds.1),
    )
}

/// By this much more two pieces must share to stand for their place: of equals it is the first.
const MUCH_MORE: f64 = 1.01;

/// More places than this are not told apart for one pair of roads.
const MOST_SPOTS: usize = 16;

/// Places where roads cover the same ground, in the order in which they were found.
#[derive(Default)]
struct Spots<'p> {
    spots: Vec<Spot<'p>>,
    /// Those of each pair of roads.
    of_pair: HashMap<(usize, usize), Vec<usize>>,
}

struct Spot<'p> {
    main: Overlap<'p>,
    /// The greatest area that two pieces share.
    most: f64,
    /// How far the place goes along the one road and the other.
    ranges: [[f64; 2]; 2],
}

impl<'p> Spots<'p> {
    fn put(&mut self, one: &'p Slice, other: &'p Slice, area: f64, point: Point) {
        let of_pair = self.of_pair.entry((one.road, other.road)).or_default();
        let ranges = [one, other].map(|slice| [slice.from, slice.to]);
        let next_to = |index: &&usize| {
            let spot = self.spots.get(**index);
            spot.is_some_and(|spot| spot.ranges.iter().zip(&ranges).all(|(a, b)| touch(*a, *b)))
        };
        let full = of_pair.len() >= MOST_SPOTS;
        let at = of_pair
            .iter()
            .find(next_to)
            .or(of_pair.last().filter(|_| full));
        if let Some(spot) = at.and_then(|at| self.spots.get_mut(*at)) {
            let whole = spot.main.area + area;
            if area > MUCH_MORE * spot.most {
                let z = other.z;
                spot.main = Overlap {
                    one,
                    other,
                    area,
                    point,
                    z,
                };
            }
            spot.main.area = whole;
            spot.most = spot.most.max(area);
            for (all, range) in spot.ranges.iter_mut().zip(&ranges) {
                *all = [all[0].min(range[0]), all[1].max(range[1])];
            }
            return;
        }
        of_pair.push(self.spots.len());
        self.spots.push(Spot {
            main: Overlap {
                one,
                other,
                area,
                point,
                z: other.z,
            },
            most: area,
            ranges,
        });
    }

    fn tell(self, limits: &Limits, mut found: impl FnMut(Overlap<'p>)) {
        let large = self
            .spots
            .into_iter()
            .filter(|spot| spot.most > limits.area);
        large.for_each(|spot| found(spot.main));
    }
}

/// Whether two stretches of a road lie next to each other, but for one piece.
fn touch(one: [f64; 2], other: [f64; 2]) -> bool {
    let piece = other[1] - other[0];
    one[0] <= other[1] + piece && other[0] <= one[1] + piece
}

/// Which pieces touch which cell, in the order in which they were put there. All lists share their
/// memory: there are as many cells as pieces.
#[derive(Default)]
struct Cells {
    /// The first and the last entry of each cell.
    ends: HashMap<(i64, i64), (u32, u32)>,
    /// Pieces, each with the next entry of its cell.
    entries: Vec<(u32, Option<u32>)>,
}

impl Cells {
    /// Puts a piece into a cell; those that were there before.
    fn put(&mut self, cell: (i64, i64), piece: u32) -> impl Iterator<Item = u32> {
        let place = u32::try_from(self.entries.len()).unwrap_or(u32::MAX);
        self.entries.push((piece, None));
        let mut next = match self.ends.entry(cell) {
            Entry::Vacant(free) => {
                free.insert((place, place));
                None
            }
            Entry::Occupied(mut taken) => {
                let (first, last) = taken.get_mut();
                if let Some((_, next)) = self.entries.get_mut(*last as usize) {
                    *next = Some(place);
                }
                *last = place;
                Some(*first)
            }
        };
        std::iter::from_fn(move || {
            let at = next.filter(|at| *at != place)?;
            let (piece, after) = *self.entries.get(at as usize)?;
            next = after;
            Some(piece)
        })
    }
}

/// The cells that a piece touches; none when it is too large to be a piece of a road.
fn cells_of(slice: &Slice) -> impl Iterator<Item = (i64, i64)> + use<> {
    let Bounds(x, y) = slice.bounds;
    let [left, right] = x.map(|x| (x / CELL).floor());
    let [bottom, top] = y.map(|y| (y / CELL).floor());
    let fits = (right - left + 1.0) * (top - bottom + 1.0) <= MOST_CELLS
        && [left, right, bottom, top]
            .iter()
            .all(|place| place.abs() < 1e12);
    let rows = fits.then_some(bottom as i64..=top as i64);
    let columns = left as i64..=right as i64;
    let cells = move |y: i64| columns.clone().map(move |x| (x, y));
    rows.into_iter().flatten().flat_map(cells)
}

/// The area that two pieces have in common, and its middle.
fn common(one: &Slice, other: &Slice) -> Option<(f64, Point)> {
    let mut shape = one.corners.to_vec();
    for at in 0..4 {
        let (a, b) = (other.corners[at], other.corners[(at + 1) % 4]);
        shape = cut(&shape, a, b);
        if shape.len() < 3 {
            return None;
        }
    }
    let first = *shape.first()?;
    let area: f64 = shape
        .windows(2)
        .map(|pair| 0.5 * turn(first, pair[0], pair[1]))
        .sum();
    let count = shape.len() as f64;
    let sum = |part: fn(&Point) -> f64| shape.iter().map(part).sum::<f64>() / count;
    Some((
        area,
        Point::finite(sum(|point| point.x), sum(|point| point.y))?,
    ))
}

/// What of a convex polygon lies to the left of a line.
pub(crate) fn cut(shape: &[Point], a: Point, b: Point) -> Vec<Point> {
    let mut kept = Vec::with_capacity(shape.len() + 2);
    for (one, next) in super::polygons::sides(shape) {
        let (here, there) = (turn(a, b, one), turn(a, b, next));
        if here >= 0.0 {
            kept.push(one);
        }
        if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
            let share = here / (here - there);
            kept.push(Point {
                x: one.x + share * (next.x - one.x),
                y: one.y + share * (next.y - one.y),
            });
        }
    }
    kept
}

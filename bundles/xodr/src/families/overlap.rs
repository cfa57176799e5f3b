//! Roads that cover the same ground (OpenDRIVE 1.9, 10.1).
//!
//! Roads are cut into pieces of a few metres: quadrangles with the width of the lanes for vehicles.
//! A grid finds pieces that may overlap. The work is limited for every map.

use std::collections::hash_map::Entry;

use super::driving::is_drivable;
use crate::prelude::*;
use foldhash::HashMap;
use qcbus_opendrive::LaneLayer;

/// Length of a piece in metres. It is larger on maps with more than [`MOST_PIECES`] pieces.
const STEP: f64 = 5.0;
const MOST_PIECES: f64 = 400_000.0;

/// Tolerance of the clearance in metres. Smaller differences count as sufficient clearance.
const SAME: f64 = 1e-6;

/// Size of a grid cell in metres, and maximum number of cells of one piece.
const CELL: f64 = 10.0;
const MOST_CELLS: f64 = 400.0;

/// A piece of a road.
pub(crate) struct Slice {
    pub road: usize,
    /// s of the start and of the end, in metres.
    pub from: f64,
    pub to: f64,
    pub width: f64,
    z: f64,
    corners: [Point; 4],
    bounds: Bounds,
}

/// Bounding rectangle of a piece: minimum and maximum of x, then of y.
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

/// A place where two roads cover the same ground, with the two pieces that overlap most.
pub(crate) struct Overlap<'p> {
    pub one: &'p Slice,
    pub other: &'p Slice,
    /// Area of the whole place in square metres.
    pub area: f64,
    /// A point in both pieces.
    pub point: Point,
    pub z: f64,
}

/// Limits that define an overlap.
pub(crate) struct Limits {
    /// Minimum area in square metres.
    pub area: f64,
    /// Distance in metres by which each edge is moved inward.
    pub shrink: f64,
    /// Vertical clearance in metres. Roads with at least this distance in height do not overlap.
    pub clearance: f64,
}

/// Returns the pieces of all roads.
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

/// Checks whether vehicles travel along a lane. These are the lanes of annex D except hard
/// shoulders, edges and the like, which neighbouring roads sometimes share.
fn is_travelled(lane: LaneRef<'_, '_>) -> bool {
    let aside = matches!(lane.kind(), Some("border" | "stop" | "restricted"));
    is_drivable(lane) && !aside
}

/// Returns which lanes of a section are for vehicles, left and right, up to the outermost one.
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

/// Returns the left and the right end of the lanes for vehicles at s, and the elevation. `lanes`
/// contains the entries for each section of the layer.
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
    // If a border turns back, the corners are not in order and the piece cannot be compared.
    let convex = (0..4).all(|at| {
        let [a, b, c] = [0, 1, 2].map(|next| corners[(at + next) % 4]);
        turn(a, b, c) > 0.0
    });
    convex.then_some(slice)
}

/// Returns twice the signed area of a triangle.
pub(crate) fn turn(a: Point, b: Point, c: Point) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)
}

/// Calls `found` for each place where two roads, or two parts of one road, cover the same ground. A
/// place counts if two pieces that `wanted` accepts share more than the minimum area. The result
/// contains the two pieces that overlap most and the area of the whole place.
pub(crate) fn overlaps<'p>(
    slices: &'p [Slice],
    limits: &Limits,
    wanted: impl Fn(&Slice, &Slice) -> bool,
    found: impl FnMut(Overlap<'p>),
) {
    let mut cells = Cells::default();
    let mut spots = Spots::default();
    // The budget suffices for every real map and limits the work on stacked pieces.
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
                // Pieces that share several cells are compared only in the first of them.
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

/// Cost of a comparison of two pieces, relative to a lookup of a pair.
const COMPARED: usize = 8;

/// Returns the first common cell of two pieces whose rectangles meet.
fn first_common(one: &Slice, other: &Slice) -> (i64, i64) {
    let first = |one: [f64; 2], other: [f64; 2]| (one[0].max(other[0]) / CELL).floor() as i64;
    (
        first(one.bounds.0, other.bounds.0),
        first(one.bounds.1, other.bounds.1),
    )
}

/// Factor by which a larger shared area replaces the pieces of a place. Equal areas do not.
const MUCH_MORE: f64 = 1.01;

/// Maximum number of places that are distinguished for one pair of roads.
const MOST_SPOTS: usize = 16;

/// Places where roads cover the same ground, in the order of discovery.
#[derive(Default)]
struct Spots<'p> {
    spots: Vec<Spot<'p>>,
    /// Indices of the places of each pair of roads.
    of_pair: HashMap<(usize, usize), Vec<usize>>,
}

struct Spot<'p> {
    main: Overlap<'p>,
    /// The largest area that two pieces share.
    most: f64,
    /// Extent of the place along the first and the second road.
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

/// Checks whether two stretches of a road are at most one piece apart.
fn touch(one: [f64; 2], other: [f64; 2]) -> bool {
    let piece = other[1] - other[0];
    one[0] <= other[1] + piece && other[0] <= one[1] + piece
}

/// The pieces in each cell, in the order of insertion. All lists share one allocation, because
/// there are as many cells as pieces.
#[derive(Default)]
struct Cells {
    /// Indices of the first and the last entry of each cell.
    ends: HashMap<(i64, i64), (u32, u32)>,
    /// Pieces, each with the index of the next entry of its cell.
    entries: Vec<(u32, Option<u32>)>,
}

impl Cells {
    /// Puts a piece into a cell and returns the earlier pieces of this cell.
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

/// Returns the cells that a piece touches, or none if the piece is too large for a road.
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

/// Returns the common area of two pieces and its middle.
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

/// Returns the part of a convex polygon to the left of a line.
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

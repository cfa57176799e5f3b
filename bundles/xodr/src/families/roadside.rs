//! Signals and objects along roads, and their positions.

use std::cell::OnceCell;

use super::object_parts::number;
use crate::prelude::*;
use foldhash::HashSet;

/// Returns the objects and then the signals of a road, without references.
pub(crate) fn things<'a>(road: &Road<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    let objects = road.objects().map(|object| object.node());
    let signals = road.signals().map(|signal| signal.node());
    objects.chain(signals)
}

/// A lane, with the distance of a point within it from the nearer border, in metres.
pub(crate) struct Spot<'m, 'a> {
    pub lane: LaneRef<'m, 'a>,
    pub depth: f64,
}

/// Returns the permanent lane at a position of a road.
pub(crate) fn lane_at<'m, 'a>(road: &'m Road<'a>, s: f64, t: f64) -> Option<Spot<'m, 'a>> {
    let layer = road.permanent()?;
    [Side::Right, Side::Left].into_iter().find_map(|side| {
        let section = layer.section_at(road, side, s)?;
        let ds = s - section.s()?;
        section.each_span(side, ds).find_map(|span| {
            let depth = (t - span.inner).abs().min((t - span.outer).abs());
            let within = (t - span.inner) * (t - span.outer) < 0.0;
            within.then_some(Spot {
                lane: span.lane,
                depth,
            })
        })
    })
}

/// Returns t of the rightmost and the leftmost border of a road.
pub(crate) fn edges_at(road: &Road<'_>, s: f64) -> Option<[f64; 2]> {
    let layer = road.permanent()?;
    let edge = |side| {
        let section = layer.section_at(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    };
    let (right, left) = (edge(Side::Right)?, edge(Side::Left)?);
    Some([right.min(left), right.max(left)])
}

/// Returns the distance of t from the lanes, or else from the reference line, in metres.
pub(crate) fn beside(road: &Road<'_>, s: f64, t: f64) -> f64 {
    let [right, left] = edges_at(road, s).unwrap_or([0.0, 0.0]);
    (t - left).max(right - t).max(0.0)
}

/// Cells that contain roads, for finding roads near a position. They are built on first use.
pub(crate) struct NearRoads {
    /// A quarter of the reach, in metres.
    cell: f64,
    cells: OnceCell<HashSet<(i64, i64)>>,
}

/// Maximum number of road positions in the index. It limits the cost of absurd lengths.
const MOST_PLACES: f64 = 1e6;

impl NearRoads {
    /// Creates an index for distances of `reach` metres.
    pub fn new(reach: f64) -> NearRoads {
        NearRoads {
            cell: 0.25 * reach.max(1.0),
            cells: OnceCell::new(),
        }
    }

    /// Checks whether a road may pass within the reach of a position. A "no" is reliable.
    pub fn any(&self, map: &RoadMap<'_>, road: &Road<'_>, s: f64, t: f64) -> Option<bool> {
        let place = road.pose(s)?.beside(t)?;
        let cells = self.cells.get_or_init(|| self.lay_out(map));
        let (x, y) = self.cell(place.x, place.y);
        let beside = |one: i64| (-5..=5).map(move |by| one.saturating_add(by));
        let around = beside(x).flat_map(|x| beside(y).map(move |y| (x, y)));
        Some(around.into_iter().any(|cell| cells.contains(&cell)))
    }

    fn cell(&self, x: f64, y: f64) -> (i64, i64) {
        (
            (x / self.cell).floor() as i64,
            (y / self.cell).floor() as i64,
        )
    }

    fn lay_out(&self, map: &RoadMap<'_>) -> HashSet<(i64, i64)> {
        let lengths = map.roads().iter().filter_map(Road::length);
        let all: f64 = lengths.filter(|length| *length > 0.0).sum();
        let step = self.cell.max(all / MOST_PLACES);
        let mut cells = HashSet::default();
        for road in map.roads() {
            let Some(length) = road.length().filter(|length| *length >= 0.0) else {
                continue;
            };
            let count = (length / step).ceil();
            for index in 0..=(count as u64) {
                let s = (index as f64 * step).min(length);
                if let Some(pose) = road.pose(s) {
                    cells.insert(self.cell(pose.x, pose.y));
                }
            }
        }
        cells
    }
}

/// Checks whether an object or signal stands at the position in its own attributes. This is false
/// for repeated ones and for those with a separate position element.
pub(crate) fn stands_itself(node: Node<'_>) -> bool {
    let elsewhere = ["repeat", "positionRoad", "positionInertial"];
    !elsewhere.iter().any(|name| node.child(name).is_some())
}

/// Returns `@s` and `@t` if the position is on the road.
pub(crate) fn place(node: Node<'_>, road: &Road<'_>) -> Option<(f64, f64)> {
    let (s, t) = number(node, "s").zip(number(node, "t"))?;
    let length = road.length()?;
    (0.0..=length).contains(&s).then_some((s, t))
}

/// Repetition of an object along a road.
pub(crate) struct Row {
    /// Start and end of the row, as s and t.
    pub ends: [(f64, f64); 2],
    /// Distance between single copies, or `None` if the row has no gaps.
    pub distance: Option<f64>,
    /// Whether the row is straight from end to end instead of following the road.
    pub is_straight: bool,
}

/// Maximum number of copies of a row that are checked.
const MOST_COPIES: f64 = 100.0;

impl Row {
    /// Returns the row of a `<repeat>` if it lies on the road.
    pub fn of(repeat: Node<'_>, road: &Road<'_>) -> Option<Row> {
        let object = repeat.parent()?;
        let (s, length) = number(repeat, "s").zip(number(repeat, "length"))?;
        let from = number(repeat, "tStart").or_else(|| number(object, "t"))?;
        let to = number(repeat, "tEnd").unwrap_or(from);
        let range = 0.0..=road.length()?;
        let is_on_road = length >= 0.0 && range.contains(&s) && range.contains(&(s + length));
        is_on_road.then_some(Row {
            ends: [(s, from), (s + length, to)],
            distance: number(repeat, "distance").filter(|distance| *distance > 0.0),
            is_straight: repeat.attr("detachFromReferenceLine") == Some("true"),
        })
    }

    /// Returns the positions of the copies. From a very long row it returns a sample.
    pub fn copies(&self) -> impl Iterator<Item = (f64, f64)> + use<> {
        let [(s, from), (end, to)] = self.ends;
        let length = end - s;
        let step = self.distance.filter(|_| !self.is_straight);
        let step = step.unwrap_or(length).max(length / MOST_COPIES);
        let most = if step > 0.0 { length / step } else { 0.0 };
        (0..=(most + 1e-6) as u64).map(move |index| {
            let share = if length > 0.0 {
                (index as f64 * step / length).min(1.0)
            } else {
                0.0
            };
            (s + share * length, from + share * (to - from))
        })
    }
}

/// Returns t of the rightmost and the leftmost border of the lanes of these types.
pub(crate) fn lanes_at(road: &Road<'_>, s: f64, kinds: &[&str]) -> Option<[f64; 2]> {
    let layer = road.permanent()?;
    let mut range: Option<[f64; 2]> = None;
    for side in [Side::Right, Side::Left] {
        let Some(section) = layer.section_at(road, side, s) else {
            continue;
        };
        for span in section.each_span(side, s - section.s()?) {
            if !span.lane.kind().is_some_and(|kind| kinds.contains(&kind)) {
                continue;
            }
            let (low, high) = (span.inner.min(span.outer), span.inner.max(span.outer));
            let [right, left] = range.unwrap_or([low, high]);
            range = Some([right.min(low), left.max(high)]);
        }
    }
    range
}

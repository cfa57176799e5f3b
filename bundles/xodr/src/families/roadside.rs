//! What stands at roads: signals and objects, and where they stand.

use std::cell::OnceCell;

use foldhash::HashSet;
use qcbus_document::Node;
use qcbus_opendrive::{LaneRef, Road, RoadMap, Side};

use super::object_parts::number;

/// The signals and objects of a road, references left out, in document order.
pub(crate) fn things<'a>(road: &Road<'a>) -> impl Iterator<Item = Node<'a>> + use<'a> {
    let objects = road.objects().map(|object| object.node());
    let signals = road.signals().map(|signal| signal.node());
    objects.chain(signals)
}

/// A lane with how far a place within it lies from the nearer of its borders, in metres.
pub(crate) struct Spot<'m, 'a> {
    pub lane: LaneRef<'m, 'a>,
    pub depth: f64,
}

/// The permanent lane at a place of a road.
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

/// t of the rightmost and the leftmost border of a road.
pub(crate) fn edges_at(road: &Road<'_>, s: f64) -> Option<[f64; 2]> {
    let layer = road.permanent()?;
    let edge = |side| {
        let section = layer.section_at(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    };
    let (right, left) = (edge(Side::Right)?, edge(Side::Left)?);
    Some([right.min(left), right.max(left)])
}

/// How far t lies beside the lanes of a road, in metres; beside the reference line where they are unknown.
pub(crate) fn beside(road: &Road<'_>, s: f64, t: f64) -> f64 {
    let [right, left] = edges_at(road, s).unwrap_or([0.0, 0.0]);
    (t - left).max(right - t).max(0.0)
}

/// Whether roads pass near a place. The roads are laid out when it is asked for the first time.
pub(crate) struct NearRoads {
    /// A quarter of the reach, in metres.
    cell: f64,
    cells: OnceCell<HashSet<(i64, i64)>>,
}

/// No more places of a map are laid out than this, so that absurd lengths cost nothing.
const MOST_PLACES: f64 = 1e6;

impl NearRoads {
    /// For distances of `reach` metres.
    pub fn new(reach: f64) -> NearRoads {
        NearRoads {
            cell: 0.25 * reach.max(1.0),
            cells: OnceCell::new(),
        }
    }

    /// Whether a road may pass within the reach of a place beside this one. Sure when it says no.
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

/// Whether an object or signal stands where its own attributes say: what is repeated does not, nor
/// what has a position of its own.
pub(crate) fn stands_itself(node: Node<'_>) -> bool {
    let elsewhere = ["repeat", "positionRoad", "positionInertial"];
    !elsewhere.iter().any(|name| node.child(name).is_some())
}

/// `@s` and `@t` on the road.
pub(crate) fn place(node: Node<'_>, road: &Road<'_>) -> Option<(f64, f64)> {
    let (s, t) = number(node, "s").zip(number(node, "t"))?;
    let length = road.length()?;
    (0.0..=length).contains(&s).then_some((s, t))
}

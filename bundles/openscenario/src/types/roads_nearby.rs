//! Index of the roads by position.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_opendrive::geometry::Pose;
use qcbus_opendrive::{Road, RoadMap, Side};

/// Edge length of a cell in metres. It is larger than the width of most roads.
const CELL: f64 = 50.0;
/// Distance between two samples along a road in metres.
const STEP: f64 = 5.0;
/// Maximum number of samples of a map.
const MOST: f64 = 1_000_000.0;

/// A cross section of a road.
#[derive(Debug)]
struct Sample {
    road: usize,
    s: f64,
    pose: Pose,
    right: f64,
    left: f64,
}

/// The roads of a map by position.
#[derive(Debug)]
pub struct RoadsNearby {
    step: f64,
    samples: Vec<Sample>,
    cells: HashMap<(i64, i64), Vec<u32>>,
    /// Largest distance of a lane edge from the reference line.
    widest: f64,
}

impl RoadsNearby {
    /// Samples all roads of a map.
    pub fn of(map: &RoadMap<'_>) -> RoadsNearby {
        let length: f64 = map.roads().iter().filter_map(|road| road.length()).sum();
        let mut nearby = RoadsNearby {
            step: STEP.max(length / MOST),
            samples: Vec::new(),
            cells: HashMap::new(),
            widest: 0.0,
        };
        for road in map.roads() {
            nearby.add(road);
        }
        nearby
    }

    fn add(&mut self, road: &Road<'_>) {
        let Some(length) = road.length().filter(|length| *length >= 0.0) else {
            return;
        };
        let mut s = 0.0;
        loop {
            if let Some(sample) = sample(road, s) {
                self.widest = self.widest.max(sample.left).max(-sample.right);
                let at = u32::try_from(self.samples.len()).unwrap_or(u32::MAX);
                let cell = cell(sample.pose.x, sample.pose.y);
                self.cells.entry(cell).or_default().push(at);
                self.samples.push(sample);
            }
            if s >= length {
                return;
            }
            s = (s + self.step).min(length);
        }
    }

    /// Checks whether the position of every road is unknown.
    pub fn is_empty(&self) -> bool {
        self.samples.is_empty()
    }

    /// Returns the cross sections within a square around a place, and possibly some more.
    fn around(&self, x: f64, y: f64, reach: f64) -> impl Iterator<Item = &Sample> {
        const MOST_CELLS: i64 = 100;
        let (low, high) = (cell(x - reach, y - reach), cell(x + reach, y + reach));
        let is_wide = |low: i64, high: i64| high.saturating_sub(low) > MOST_CELLS;
        let all = is_wide(low.0, high.0) || is_wide(low.1, high.1);
        let everything = if all { &self.samples[..] } else { &[] };
        let rows = (!all).then_some(low.0..=high.0).into_iter().flatten();
        let cells = rows.flat_map(move |i| (low.1..=high.1).map(move |j| (i, j)));
        let places = cells.filter_map(|cell| self.cells.get(&cell)).flatten();
        let near = places.filter_map(|at| self.samples.get(*at as usize));
        near.chain(everything)
    }

    /// Checks whether a lane is within this distance.
    pub fn is_near(&self, x: f64, y: f64, distance: f64) -> bool {
        let reach = distance + self.widest.min(10.0 * CELL) + self.step;
        self.around(x, y, reach).any(|sample| {
            let (along, t) = seen_from(sample.pose, x, y);
            let aside = (t - sample.left).max(sample.right - t).max(0.0);
            let beyond = (along.abs() - self.step / 2.0).max(0.0);
            aside.hypot(beyond) <= distance
        })
    }

    /// Returns the roads with lanes at this place, in the order of the map. `map` must be the one
    /// that this index was built from.
    pub fn roads_at<'m, 'r>(&self, map: &'m RoadMap<'r>, x: f64, y: f64) -> Vec<&'m Road<'r>> {
        let stations = self.stations_at(map, x, y);
        let mut roads: Vec<usize> = stations.map(|(road, _, _)| road).collect();
        roads.sort_unstable();
        roads.dedup();
        let roads = roads.into_iter();
        roads.filter_map(|at| map.roads().get(at)).collect()
    }

    /// Returns the only road with lanes at this place, and the s and t of the place. Returns `None`
    /// if there is no such road, or more than one.
    pub fn only_road_at<'m, 'r>(
        &self,
        map: &'m RoadMap<'r>,
        x: f64,
        y: f64,
    ) -> Option<(&'m Road<'r>, f64, f64)> {
        let mut all = self.stations_at(map, x, y);
        let (road, s, t) = all.next()?;
        let is_only = all.all(|(other, at, _)| other == road && (at - s).abs() < 0.1);
        let road = map.roads().get(road).filter(|_| is_only)?;
        Some((road, s, t))
    }

    /// Returns the road, s and t of a place that lies on lanes. An entry may occur more than once.
    fn stations_at(
        &self,
        map: &RoadMap<'_>,
        x: f64,
        y: f64,
    ) -> impl Iterator<Item = (usize, f64, f64)> {
        let reach = self.widest.min(10.0 * CELL) + self.step;
        self.around(x, y, reach).filter_map(move |near| {
            let (along, _) = seen_from(near.pose, x, y);
            let is_near = along.abs() <= self.step;
            let road = map.roads().get(near.road).filter(|_| is_near)?;
            let (s, t) = on(road, near.s + along, x, y)?;
            Some((near.road, s, t))
        })
    }
}

/// Returns the s and t of a place that lies well within the lanes of a road near a station.
fn on(road: &Road<'_>, near: f64, x: f64, y: f64) -> Option<(f64, f64)> {
    const WITHIN: f64 = 0.25;
    let length = road.length()?;
    let mut s = near;
    for _ in 0..4 {
        let found = sample(road, s.clamp(0.0, length))?;
        let (along, t) = seen_from(found.pose, x, y);
        if along.abs() < 0.01 {
            let is_within = t > found.right + WITHIN && t < found.left - WITHIN;
            return is_within.then_some((found.s, t));
        }
        s = found.s + along;
        if s < 0.0 || s > length {
            return None;
        }
    }
    None
}

fn sample(road: &Road<'_>, s: f64) -> Option<Sample> {
    let edge = |side| {
        let section = road.permanent()?.section_at(road, side, s)?;
        section.edge_t(side, s - section.s()?)
    };
    Some(Sample {
        road: road.index(),
        s,
        pose: road.pose(s)?,
        right: edge(Side::Right).unwrap_or(0.0),
        left: edge(Side::Left).unwrap_or(0.0),
    })
}

/// Returns the coordinates of a place along and beside a pose.
fn seen_from(pose: Pose, x: f64, y: f64) -> (f64, f64) {
    let (sin, cos) = pose.hdg.sin_cos();
    let (dx, dy) = (x - pose.x, y - pose.y);
    (dx * cos + dy * sin, dy * cos - dx * sin)
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "a position beyond the range of i64 goes into the last cell"
)]
fn cell(x: f64, y: f64) -> (i64, i64) {
    ((x / CELL).floor() as i64, (y / CELL).floor() as i64)
}

//! Remaining length of road from a place.

use crate::prelude::*;
use foldhash::{HashMap, HashMapExt as _};
use qcbus_opendrive::ContactPoint;
use qcbus_opendrive::RoadEnd;

pub(crate) use qcbus_openscenario::places::relative::{OnRoad, lanes, lanes_by, ways};

/// Maximum distances that can be driven on a map from the ends of its roads.
pub(crate) struct Reach<'m, 'd> {
    map: &'m RoadMap<'d>,
    /// The longest path beyond each end of a road. `None` if it is endless or unknown.
    longest: HashMap<RoadEnd, Option<f64>>,
}

impl<'m, 'd> Reach<'m, 'd> {
    /// Creates the reach. Returns `None` if the map has virtual junctions, where a road can be left
    /// midway.
    pub(crate) fn of(map: &'m RoadMap<'d>) -> Option<Reach<'m, 'd>> {
        let is_virtual = |kind: Option<&str>| kind == Some("virtual");
        let mut junctions = map.junctions().iter();
        if junctions.any(|junction| is_virtual(junction.node().attr("type"))) {
            return None;
        }
        Some(Reach {
            map,
            longest: HashMap::new(),
        })
    }

    /// Returns the maximum distance from a station, along the road or against it.
    pub(crate) fn from(&mut self, road: &Road<'d>, s: f64, along: bool) -> Option<f64> {
        let (end, rest) = if along {
            (ContactPoint::End, road.length()? - s)
        } else {
            (ContactPoint::Start, s)
        };
        Some(rest + self.beyond(road, end)?)
    }

    /// Returns the maximum distance beyond an end of a road.
    fn beyond(&mut self, road: &Road<'d>, end: ContactPoint) -> Option<f64> {
        // Path of ends that are passed, with the ends that are still to be visited beyond each.
        let start = RoadEnd::of(road, end);
        let mut way = vec![(start, self.next(start)?, 0.0_f64)];
        loop {
            let (here, open, best) = way.last_mut()?;
            let Some(entered) = open.pop() else {
                let (here, best) = (*here, *best);
                self.longest.insert(here, Some(best));
                way.pop();
                let Some((_, _, around)) = way.last_mut() else {
                    return Some(best);
                };
                let length = self.map.road_at(here.road)?.length()?;
                *around = around.max(best + length);
                continue;
            };
            let left = RoadEnd {
                road: entered.road,
                end: entered.end.other(),
            };
            if let Some(known) = self.longest.get(&left) {
                let length = self.map.road_at(left.road)?.length()?;
                *best = best.max((*known)? + length);
                continue;
            }
            const MOST: usize = 2_000;
            let round = way.iter().any(|(one, _, _)| *one == left);
            let next = self.next(left);
            match next.filter(|_| !round && way.len() < MOST) {
                Some(next) => way.push((left, next, 0.0)),
                None => {
                    for (one, _, _) in way {
                        self.longest.insert(one, None);
                    }
                    return None;
                }
            }
        }
    }

    /// Returns the ends of other roads that touch an end. Returns `None` if a link cannot be
    /// resolved.
    fn next(&self, end: RoadEnd) -> Option<Vec<RoadEnd>> {
        let road = self.map.road_at(end.road)?;
        let next = self.map.neighbours(road, end.end);
        (!next.is_empty() || road.link(end.end).is_none()).then_some(next)
    }
}

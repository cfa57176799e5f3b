//! A map with data that scenarios need of it.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use qcbus_document::{Image, ImageError};
use qcbus_opendrive::{LaneRef, OwnedMap, Road, RoadMap, SectionRef, Side};

use crate::types::roads_nearby::RoadsNearby;
use crate::types::ways::Ways;

/// A map with data that is derived from it for scenarios. It may be cached for all scenarios on
/// this map, so that the data is computed only once.
#[derive(Debug)]
pub struct RoadNetwork {
    map: OwnedMap,
    nearby: OnceLock<RoadsNearby>,
    ways: OnceLock<Option<Ways>>,
    lane_ids: OnceLock<Option<BTreeSet<i64>>>,
    most_lanes: OnceLock<u64>,
}

impl RoadNetwork {
    /// Creates the road network from an image.
    ///
    /// # Errors
    /// Fails if the bytes are no valid image.
    pub fn of(image: Image) -> Result<RoadNetwork, ImageError> {
        Ok(RoadNetwork {
            map: OwnedMap::of(image)?,
            nearby: OnceLock::new(),
            ways: OnceLock::new(),
            lane_ids: OnceLock::new(),
            most_lanes: OnceLock::new(),
        })
    }

    /// Calls `look` with the map. Borrows from the map cannot leave the closure.
    pub fn with<T>(&self, look: impl for<'r> FnOnce(&RoadMap<'r>) -> T) -> T {
        self.map.with(look)
    }

    /// Returns the index of roads by position.
    pub fn nearby(&self) -> &RoadsNearby {
        self.nearby.get_or_init(|| self.with(RoadsNearby::of))
    }

    /// Returns the connections that traffic can take. Returns `None` if roads have links that do
    /// not join lanes.
    pub fn ways(&self) -> Option<&Ways> {
        self.ways.get_or_init(|| self.with(Ways::of)).as_ref()
    }

    /// Returns the ids of all lanes except the center lanes. Returns `None` if one id is unknown.
    pub fn lane_ids(&self) -> Option<&BTreeSet<i64>> {
        let ids = self.lane_ids.get_or_init(|| {
            self.with(|map| {
                let ids = map.lanes().map(|lane| lane.id());
                ids.filter(|id| *id != Some(0)).collect()
            })
        });
        ids.as_ref()
    }

    /// Returns the largest number of lanes of a road. Each side counts with the lane section that
    /// has the most lanes.
    pub fn most_lanes(&self) -> u64 {
        *self.most_lanes.get_or_init(|| {
            self.with(|map| map.roads().iter().map(lanes_of).max())
                .unwrap_or(0)
        })
    }
}

fn lanes_of(road: &Road<'_>) -> u64 {
    let most = |side| {
        road.sections()
            .map(move |section| section.side(side).count())
    };
    let most = Side::BOTH.map(|side| most(side).max().unwrap_or(0) as u64);
    most.iter().sum()
}

/// Result of the lookup of a lane at a station of a road.
#[derive(Debug, Clone, Copy)]
pub enum LaneAt<'m, 'r> {
    /// The lane exists.
    Lane(LaneRef<'m, 'r>),
    /// The lane section there has no lane of this id.
    None(SectionRef<'m, 'r>),
    /// The map is broken at this station.
    Unknown,
}

impl<'m, 'r> LaneAt<'m, 'r> {
    /// Looks up the lane of a road at a station.
    pub fn of(road: &'m Road<'r>, s: f64, lane: i64) -> LaneAt<'m, 'r> {
        let side = Side::of_lane_id(lane).unwrap_or(Side::Right);
        let Some(layer) = road.permanent() else {
            return LaneAt::Unknown;
        };
        let Some(section) = layer.section_at(road, side, s) else {
            return LaneAt::Unknown;
        };
        section
            .lane(lane)
            .map_or(LaneAt::None(section), LaneAt::Lane)
    }
}

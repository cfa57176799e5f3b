//! The road network that a scenario takes place on.

use std::collections::BTreeSet;
use std::sync::OnceLock;

use qcbus_document::{Image, ImageError};
use qcbus_opendrive::{LaneRef, OwnedMap, Road, RoadMap, SectionRef, Side};

use crate::inputs::LinkedMap;
use crate::roads_nearby::RoadsNearby;
use crate::scenario::Scenario;
use crate::ways::Ways;

/// What is known of the road network.
#[derive(Debug, Clone, Copy)]
pub enum Network<'m> {
    /// The scenario names none.
    Unnamed,
    /// A map that only the simulator knows.
    Simulator,
    /// It is named, and could not be read: said elsewhere.
    NotHad,
    /// It is no OpenDRIVE map.
    Foreign,
    /// Its roads.
    Map(&'m RoadNetwork),
}

impl<'m> Network<'m> {
    /// The roads, if they are known.
    pub fn map(self) -> Option<&'m RoadNetwork> {
        match self {
            Network::Map(network) => Some(network),
            Network::Unnamed | Network::Simulator | Network::NotHad | Network::Foreign => None,
        }
    }
}

/// A map and what scenarios ask of it. It may be kept for all scenarios on this map: whatever it
/// has found out about its roads it need not find out again.
#[derive(Debug)]
pub struct RoadNetwork {
    map: OwnedMap,
    nearby: OnceLock<RoadsNearby>,
    ways: OnceLock<Option<Ways>>,
    lane_ids: OnceLock<Option<BTreeSet<i64>>>,
    most_lanes: OnceLock<u64>,
}

impl RoadNetwork {
    /// The road network of an image.
    ///
    /// # Errors
    /// When the bytes are no image.
    pub fn of(image: Image) -> Result<RoadNetwork, ImageError> {
        Ok(RoadNetwork {
            map: OwnedMap::of(image)?,
            nearby: OnceLock::new(),
            ways: OnceLock::new(),
            lane_ids: OnceLock::new(),
            most_lanes: OnceLock::new(),
        })
    }

    /// Looks at the map. What borrows from it stays inside.
    pub fn with<T>(&self, look: impl for<'r> FnOnce(&RoadMap<'r>) -> T) -> T {
        self.map.with(look)
    }

    /// Which roads are near a place.
    pub fn nearby(&self) -> &RoadsNearby {
        self.nearby.get_or_init(|| self.with(RoadsNearby::of))
    }

    /// Where traffic gets from where; `None` where roads are linked in ways that do not join lanes.
    pub fn ways(&self) -> Option<&Ways> {
        self.ways.get_or_init(|| self.with(Ways::of)).as_ref()
    }

    /// The ids of all lanes but the center lanes; `None` when one is not known.
    pub fn lane_ids(&self) -> Option<&BTreeSet<i64>> {
        let ids = self.lane_ids.get_or_init(|| {
            self.with(|map| {
                let ids = map.lanes().map(|lane| lane.id());
                ids.filter(|id| *id != Some(0)).collect()
            })
        });
        ids.as_ref()
    }

    /// The most lanes that a road has on both sides together, in whichever of its lane sections.
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

/// Whether a road has a lane at a station.
#[derive(Debug, Clone, Copy)]
pub enum LaneAt<'m, 'r> {
    /// This one.
    Lane(LaneRef<'m, 'r>),
    /// The lane section there has no lane of this id.
    None(SectionRef<'m, 'r>),
    /// The map is broken there.
    Unknown,
}

impl<'m, 'r> LaneAt<'m, 'r> {
    /// The lane of a road at a station.
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

impl Scenario<'_> {
    /// The road network.
    pub fn network(&self) -> Network<'_> {
        match self.map_input() {
            LinkedMap::Unnamed => Network::Unnamed,
            LinkedMap::Simulator => Network::Simulator,
            LinkedMap::NotHad => Network::NotHad,
            LinkedMap::Foreign => Network::Foreign,
            LinkedMap::Roads(network) => Network::Map(network),
        }
    }

    /// Looks at the map, if it is known. What borrows from it stays inside.
    pub fn on_map<T>(&self, look: impl for<'r> FnOnce(&RoadMap<'r>) -> T) -> Option<T> {
        self.network().map().map(|network| network.with(look))
    }
}

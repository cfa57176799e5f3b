//! Road network of a scenario.

use qcbus_opendrive::RoadMap;

use crate::queries::scenario::Scenario;
use crate::types::inputs::LinkedMap;
use crate::types::road_network::RoadNetwork;

/// State of the road network.
#[derive(Debug, Clone, Copy)]
pub enum Network<'m> {
    /// The scenario names no road network.
    Unnamed,
    /// A map that only the simulator knows.
    Simulator,
    /// The map is named but could not be read. This is reported elsewhere.
    NotHad,
    /// The file is no OpenDRIVE map.
    Foreign,
    /// The roads of the map.
    Map(&'m RoadNetwork),
}

impl<'m> Network<'m> {
    /// Returns the roads, if they are known.
    pub fn map(self) -> Option<&'m RoadNetwork> {
        match self {
            Network::Map(network) => Some(network),
            Network::Unnamed | Network::Simulator | Network::NotHad | Network::Foreign => None,
        }
    }
}

impl Scenario<'_> {
    /// Returns the road network.
    pub fn network(&self) -> Network<'_> {
        match &self.map {
            LinkedMap::Unnamed => Network::Unnamed,
            LinkedMap::Simulator => Network::Simulator,
            LinkedMap::NotHad => Network::NotHad,
            LinkedMap::Foreign => Network::Foreign,
            LinkedMap::Roads(network) => Network::Map(network),
        }
    }

    /// Calls `look` with the map, if it is known. Borrows from the map cannot leave the closure.
    pub fn on_map<T>(&self, look: impl for<'r> FnOnce(&RoadMap<'r>) -> T) -> Option<T> {
        self.network().map().map(|network| network.with(look))
    }
}

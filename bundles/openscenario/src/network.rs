//! The road network that a scenario takes place on.

use qcbus_opendrive::{LaneRef, Road, RoadMap, SectionRef, Side};

use crate::inputs::LinkedMap;
use crate::scenario::Scenario;

/// What is known of the road network.
#[derive(Debug, Clone, Copy)]
pub enum Network<'m, 'd> {
    /// The scenario names none.
    Unnamed,
    /// A map that only the simulator knows.
    Simulator,
    /// It is named, and could not be read: said elsewhere.
    NotHad,
    /// It is no OpenDRIVE map.
    Foreign,
    /// Its roads.
    Map(&'m RoadMap<'d>),
}

impl<'m, 'd> Network<'m, 'd> {
    /// The map, if it is known.
    pub fn map(self) -> Option<&'m RoadMap<'d>> {
        match self {
            Network::Map(map) => Some(map),
            Network::Unnamed | Network::Simulator | Network::NotHad | Network::Foreign => None,
        }
    }
}

/// Whether a road has a lane at a station.
#[derive(Debug, Clone, Copy)]
pub enum LaneAt<'m, 'd> {
    /// This one.
    Lane(LaneRef<'m, 'd>),
    /// The lane section there has no lane of this id.
    None(SectionRef<'m, 'd>),
    /// The map is broken there.
    Unknown,
}

impl<'d> Scenario<'d> {
    /// The road network.
    pub fn network(&self) -> Network<'_, 'd> {
        match self.map_input() {
            LinkedMap::Unnamed => Network::Unnamed,
            LinkedMap::Simulator => Network::Simulator,
            LinkedMap::NotHad => Network::NotHad,
            LinkedMap::Roads(map) => Network::Map(map),
            LinkedMap::Document(document) => match document.root() {
                Some(root) if root.is("OpenDRIVE") => Network::Map(self.roads_of(document)),
                Some(_) | None => Network::Foreign,
            },
        }
    }

    /// The lane of a road at a station.
    pub fn lane_at<'m>(&self, road: &'m Road<'d>, s: f64, lane: i64) -> LaneAt<'m, 'd> {
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

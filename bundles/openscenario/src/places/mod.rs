//! Places of entities and positions on the map.

mod origins;
mod positions;
pub mod relative;
mod starts;

pub use origins::{Origins, Whereabouts, or, within};
pub use positions::{AT_END, find_lane, lane_id, lane_of, road_of, section_of, station};
pub use starts::{Start, starts};

//! Elements that need a road network.

use crate::prelude::*;

/// Elements that depend on roads, lanes or the map's datum.
pub(crate) const ON_ROADS: &[&str] = &[
    "RoadPosition",
    "LanePosition",
    "GeoPosition",
    "LaneChangeAction",
    "EndOfRoadCondition",
    "OffroadCondition",
];
/// Elements that depend on traffic signals.
pub(crate) const ON_SIGNALS: &[&str] = &[
    "TrafficSignalController",
    "TrafficSignalAction",
    "TrafficSignalCondition",
    "TrafficSignalControllerCondition",
];

/// Returns the first element of each kind, and the number of elements.
pub(crate) fn used<'m, 'd>(
    scenario: &'m Scenario<'d>,
    names: &[&'static str],
) -> Vec<(&'static str, Element<'m, 'd>, usize)> {
    let of_kind = |name: &&'static str| {
        let mut all = scenario.elements_everywhere(name);
        let first = all.next()?;
        Some((*name, first, 1 + all.count()))
    };
    names.iter().filter_map(of_kind).collect()
}

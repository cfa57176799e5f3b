//! Switches of railroads (OpenDRIVE 1.9, 15.3).

use std::collections::HashMap;

use crate::prelude::*;
use qcbus_opendrive::Switch;

/// Returns all switches by id with their road. For a shared id it returns the first one.
pub(crate) fn by_id<'m, 'a>(map: &'m RoadMap<'a>) -> HashMap<&'a str, (&'m Road<'a>, Switch<'a>)> {
    let mut all = HashMap::new();
    for road in map.roads() {
        for switch in road.switches() {
            if let Some(id) = switch.id() {
                all.entry(id).or_insert((road, switch));
            }
        }
    }
    all
}

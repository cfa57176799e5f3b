//! Gantries that carry signals (OpenDRIVE 1.9, 14.7.4).

use crate::prelude::*;
use qcbus_opendrive::Signal;

/// Returns the id of the gantry to which a signal refers as its mount.
pub(crate) fn gantry_of<'a>(map: &RoadMap<'a>, signal: &Signal<'a>) -> Option<&'a str> {
    let objects = signal
        .references()
        .filter(|one| one.element_type() == Some("object"));
    let is_gantry = |id: &&str| {
        let mut objects = map.objects_with_id(id);
        objects.any(|object| object.kind() == Some("gantry"))
    };
    objects.filter_map(|one| one.element_id()).find(is_gantry)
}

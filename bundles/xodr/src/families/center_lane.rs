//! Checks for elements that the center lane must not have.

use crate::prelude::*;
use qcbus_opendrive::LaneGroup;

/// Reports children with this name of center lanes. `why` completes the text "the center lane has
/// an element `width`, but ".
pub(crate) fn has_no(part: MapPart<'_, '_>, element: &str, why: &str, found: &mut Sink<'_>) {
    for lane in part
        .lanes()
        .filter(|lane| lane.group() == LaneGroup::Center)
    {
        for child in lane.elements(element) {
            let text = format!("the center lane has an element `{element}`, but {why}");
            let finding = found.issue(child, text);
            if let Some(s) = lane.at.s() {
                finding.road(lane.at.road.id(), s, 0.0);
            }
        }
    }
}

//! Position of a finding on its road, and names of roads and lanes in texts.

use crate::prelude::*;

/// Maximum number of further places of one kind in a finding. More are not helpful, and a hostile
/// file could make them expensive.
pub(crate) const MAX_PLACES: usize = 16;

/// Adds road coordinates and, if the map can be evaluated there, the point in space.
pub(crate) trait OnRoad {
    /// Places the finding at (s, t) of a road, in metres.
    fn on(self, road: &Road<'_>, s: f64, t: f64) -> Self;
    /// Places the finding at an end of a road's reference line.
    fn at_end(self, road: &Road<'_>, end: ContactPoint) -> Self;
    /// Places the finding in the middle of a lane, `ds` metres from the start of its section.
    fn in_lane(self, lane: LaneRef<'_, '_>, ds: impl Into<Station>) -> Self;
    /// Places the finding in the middle of a lane, at an end of its section.
    fn at_lane_end(self, lane: LaneRef<'_, '_>, end: ContactPoint) -> Self;
}

impl OnRoad for Finding<'_, '_> {
    fn on(self, road: &Road<'_>, s: f64, t: f64) -> Self {
        let finding = self.road(road.id(), s, t);
        match road.surface_point(s, t) {
            Some(point) => finding.point(point.x, point.y, point.z),
            None => finding,
        }
    }

    fn at_end(self, road: &Road<'_>, end: ContactPoint) -> Self {
        let finding = match road.end_s(end) {
            Some(s) => self.road(road.id(), s, 0.0),
            None => self,
        };
        match road.end_frame(end) {
            Some(frame) => finding.point(frame.pose.x, frame.pose.y, frame.z),
            None => finding,
        }
    }

    fn in_lane(self, lane: LaneRef<'_, '_>, ds: impl Into<Station>) -> Self {
        let ds = ds.into();
        let Some(s) = lane.at.s().map(|start| start + ds.x()) else {
            return self;
        };
        let middle = lane.inner_t(ds).zip(lane.outer_t(ds));
        let finding = self.road(
            lane.at.road.id(),
            s,
            middle.map_or(0.0, |(inner, outer)| 0.5 * (inner + outer)),
        );
        match lane.surface_point(ds, 0.5) {
            Some(point) => finding.point(point.x, point.y, point.z),
            None => finding,
        }
    }

    fn at_lane_end(self, lane: LaneRef<'_, '_>, end: ContactPoint) -> Self {
        match lane.end_station(end) {
            Some(station) => self.in_lane(lane, station),
            None => self,
        }
    }
}

/// Returns ``lane `-1` of road `5` ``. It adds the section if the layer has several, and the layer
/// if it is not the permanent one.
pub(crate) fn lane_name(lane: LaneRef<'_, '_>) -> String {
    let section = if lane.at.layer.section_count() > 1 {
        format!(" in lane section {} of", lane.at.index() + 1)
    } else {
        " of".to_owned()
    };
    let layer = match lane.at.layer.kind() {
        LayerKind::Temporary => " the temporary layer of",
        LayerKind::Permanent | LayerKind::Unknown => "",
    };
    format!(
        "lane `{}`{section}{layer} road `{}`",
        lane.id_text().unwrap_or_default(),
        lane.at.road.id()
    )
}

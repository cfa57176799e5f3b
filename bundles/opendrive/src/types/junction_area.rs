//! Boundary and elevation grid of a junction (OpenDRIVE 1.9, 12.10, 12.11).

use crate::types::value::{ContactPoint, parse_number};
use crate::types::view::{children, view};

view! {
    /// The `<boundary>` of a junction (12.10).
    Boundary {}
}

impl<'a> Boundary<'a> {
    children! {
        /// The segments in the order of the boundary.
        segments: BoundarySegment "segment",
    }
}

view! {
    /// A `<segment>` of a junction boundary (12.10).
    BoundarySegment {
        /// `@type`: `lane` or `joint`.
        kind: text "type",
        /// `@roadId`.
        road_id: text "roadId",
        /// `@boundaryLane` of a lane segment.
        boundary_lane: integer "boundaryLane",
        /// `@contactPoint` of a joint segment.
        contact_point: contact "contactPoint",
        /// `@jointLaneStart` of a joint segment.
        joint_lane_start: integer "jointLaneStart",
        /// `@jointLaneEnd` of a joint segment.
        joint_lane_end: integer "jointLaneEnd",
        /// `@transitionLength` of a joint segment, in metres.
        transition_length: number "transitionLength",
    }
}

/// A station of a road, given as a number or as one end of the road.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SegmentStation {
    /// A number: s in metres.
    S(f64),
    /// An end of the road.
    End(ContactPoint),
}

impl<'a> BoundarySegment<'a> {
    /// Returns `@sStart` of a lane segment. `begin` is an old word for `start`.
    pub fn s_start(&self) -> Option<SegmentStation> {
        segment_station(self.node.attr("sStart")?)
    }

    /// Returns `@sEnd` of a lane segment.
    pub fn s_end(&self) -> Option<SegmentStation> {
        segment_station(self.node.attr("sEnd")?)
    }
}

fn segment_station(text: &str) -> Option<SegmentStation> {
    match text {
        "begin" => Some(SegmentStation::End(ContactPoint::Start)),
        _ => match ContactPoint::parse(text) {
            Some(end) => Some(SegmentStation::End(end)),
            None => parse_number(text).map(SegmentStation::S),
        },
    }
}

view! {
    /// The `<elevationGrid>` of a junction (12.11).
    ElevationGrid {
        /// `@gridSpacing`, in metres.
        grid_spacing: number "gridSpacing",
        /// `@sStart`: the place of the first row on the junction reference line, in metres.
        s_start: number "sStart",
    }
}

impl<'a> ElevationGrid<'a> {
    children! {
        /// The rows, in ascending order of s.
        rows: GridRow "elevation",
    }
}

view! {
    /// An `<elevation>` of an elevation grid: the heights of one row.
    GridRow {
        /// `@center` as written.
        center_text: text "center",
        /// `@left` as written, from the reference line outward.
        left_text: text "left",
        /// `@right` as written, from the reference line outward.
        right_text: text "right",
    }
}

impl GridRow<'_> {
    /// Returns the height on the reference line, in metres.
    pub fn center(&self) -> Option<f64> {
        parse_number(self.center_text()?)
    }

    /// Returns the heights to the left, from inside to outside, or `None` if one is malformed.
    pub fn left(&self) -> Option<Vec<f64>> {
        heights(self.left_text())
    }

    /// Returns the heights to the right, from inside to outside, or `None` if one is malformed.
    pub fn right(&self) -> Option<Vec<f64>> {
        heights(self.right_text())
    }
}

fn heights(list: Option<&str>) -> Option<Vec<f64>> {
    let words = list.unwrap_or("").split_ascii_whitespace();
    words.map(parse_number).collect()
}

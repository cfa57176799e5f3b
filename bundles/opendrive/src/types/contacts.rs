//! Ends of roads and lanes, and the statements of a file that two of them touch (OpenDRIVE 1.9,
//! 10.3, 11.6, 12.3). The map finds them.

use qcbus_document::Node;

use crate::types::frame::BorderPoint;
use crate::types::value::ContactPoint;

/// An end of a road.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RoadEnd {
    /// Place of the road in the map.
    pub road: usize,
    /// The end of the road.
    pub end: ContactPoint,
}

/// A statement of the file that two road ends touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoadContact<'a> {
    /// One end: the end of the road with the link, or of the incoming road.
    pub from: RoadEnd,
    /// The other end: of the linked or connecting road.
    pub to: RoadEnd,
    /// Element with the statement: `<predecessor>` or `<successor>` of a road, or `<connection>`.
    pub node: Node<'a>,
    /// Place of the junction if the statement is a `<connection>`.
    pub junction: Option<usize>,
}

/// Key of a lane in the map: the places of road, layer, section and lane in document order.
/// [`RoadMap::lane`](crate::RoadMap::lane) returns the lane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneKey {
    /// Place of the road in the map.
    pub road: u32,
    /// Place of the layer in the road.
    pub layer: u32,
    /// Place of the section in the layer.
    pub section: u32,
    /// Place of the lane in the section.
    pub lane: u32,
}

/// An end of a lane within its section.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LaneEnd {
    /// The lane.
    pub lane: LaneKey,
    /// The start or the end of its section.
    pub end: ContactPoint,
}

/// A statement of the file that two lane ends touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LaneJoint<'a> {
    /// The lane with the link, or the lane on the incoming road.
    pub from: LaneEnd,
    /// The linked lane.
    pub to: LaneEnd,
    /// Element with the statement: `<predecessor>` or `<successor>` of a lane, or `<laneLink>`.
    pub node: Node<'a>,
    /// Place of the junction if the statement is a `<laneLink>`.
    pub junction: Option<usize>,
}

impl LaneJoint<'_> {
    /// Checks whether s runs in opposite directions on both sides: end touches end or start touches
    /// start.
    pub fn is_reversed(&self) -> bool {
        self.from.end == self.to.end
    }

    /// Checks whether both lanes belong to the same road.
    pub fn is_within_road(&self) -> bool {
        let (from, to) = (self.from.lane, self.to.lane);
        from.road == to.road && (from.layer, from.section) != (to.layer, to.section)
    }
}

/// Two linked lanes with the ends of their edges, as seen along s of the road of `joint.from`.
#[derive(Debug, Clone, Copy)]
pub struct TouchingLanes<'a> {
    /// The statement that the lanes touch. The first of two equal statements counts.
    pub joint: LaneJoint<'a>,
    /// The left edge: of the lane of `joint.from`, then of the lane of `joint.to`.
    pub left: [BorderPoint; 2],
    /// The right edge, in the same order.
    pub right: [BorderPoint; 2],
}

impl TouchingLanes<'_> {
    /// Returns both edges, the left one first.
    pub fn edges(&self) -> [[BorderPoint; 2]; 2] {
        [self.left, self.right]
    }

    /// Returns the width of the narrower lane at the touching point, in metres.
    pub fn narrower(&self) -> f64 {
        let width = |side: usize| (self.left[side].t - self.right[side].t).abs();
        width(0).min(width(1))
    }
}

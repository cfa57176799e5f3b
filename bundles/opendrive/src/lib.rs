//! The OpenDRIVE model: typed views and geometry over the document image.
//!
//! [`RoadMap`] is built once per document and shared by all rules. It holds the data for all rules
//! (roads, junctions, an index of ids) and computes the rest on first use. Views keep their
//! [`Node`](qcbus_document::Node), so a finding can always name its exact place.
//!
//! Numbers are `Option<f64>`: `Some` means present, well-formed and finite. A result that depends
//! on a missing or malformed number is `None`; no function panics. Section numbers in this crate
//! refer to ASAM OpenDRIVE 1.9.0.

pub mod geometry;

mod index;
mod joints;
mod junction;
mod lane;
mod lane_ref;
mod lanes;
mod lateral;
mod map;
mod names;
mod objects;
mod outlines;
mod owned;
mod part;
mod plan_view;
mod profile;
mod railroad;
mod road;
mod section_ref;
mod signals;
mod station;
mod steps;
mod strips;
mod surface;
mod touching;
mod traffic;
mod value;
mod view;

pub use joints::{LaneEnd, LaneJoint, RoadContact, RoadEnd};
pub use junction::{
    Boundary, BoundarySegment, Connection, CrossPath, CrossPathLaneLink, ElevationGrid, GridRow,
    Junction, JunctionController, JunctionLaneLink, JunctionType, Priority, RoadSection,
    SegmentStation,
};
pub use lane::{Lane, LaneGroup, LaneHeight, LaneLink, LaneRecord};
pub use lane_ref::{Edge, LaneKey, LaneRef};
pub use lanes::{LaneLayer, LaneSection};
pub use lateral::{LateralProfile, Shape, ShapeRow};
pub use map::{RoadMap, SignalKey, Version};
pub use objects::{
    CornerReference, Marking, Object, ObjectBorder, ObjectMaterial, ObjectReference, Repeat,
    Structure, Validity,
};
pub use outlines::{Corner, CornerKind, CurveLocal, ObjectPoint, Outline, Polyline};
pub use owned::OwnedMap;
pub use part::MapPart;
pub use plan_view::{Geometry, Located, PlanView, ShapeKind};
pub use profile::{Profile, Record, Stretch, Valid};
pub use railroad::{
    Crg, JunctionGroup, JunctionReference, Platform, PlatformSegment, RailroadStation, Switch,
    Track,
};
pub use road::{Road, RoadLink, RoadType, TrafficRule};
pub use section_ref::{LaneSpan, SectionRef};
pub use signals::{
    Control, Controller, DisplayArea, ElementReference, Signal, SignalBoard, SignalDependency,
    SignalReference, VmsBoardReference, VmsGroup,
};
pub use station::Station;
pub use strips::{CrossSectionSurface, Strip, StripMode};
pub use surface::{BorderPoint, Frame};
pub use touching::TouchingLanes;
pub use traffic::Traffic;
pub use value::{ContactPoint, Direction, LayerKind, Side, is_user_data};

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

mod queries;
mod types;

pub use queries::lane_ref::{Edge, LaneRef};
pub use queries::map::{RoadMap, SignalKey, Version};
pub use queries::owned::OwnedMap;
pub use queries::part::MapPart;
pub use queries::section_ref::SectionRef;
pub use queries::spans::LaneSpan;
pub use queries::traffic::Traffic;
pub use types::contacts::{LaneEnd, LaneJoint, LaneKey, RoadContact, RoadEnd, TouchingLanes};
pub use types::crg::Crg;
pub use types::frame::{BorderPoint, Frame};
pub use types::junction::{
    Connection, CrossPath, CrossPathLaneLink, Junction, JunctionController, JunctionLaneLink,
    JunctionType, Priority, RoadSection,
};
pub use types::junction_area::{Boundary, BoundarySegment, ElevationGrid, GridRow, SegmentStation};
pub use types::lane::{Lane, LaneGroup, LaneHeight, LaneLink, LaneRecord};
pub use types::lane_section::{LaneLayer, LaneSection};
pub use types::lateral::{LateralProfile, Shape, ShapeRow};
pub use types::objects::{Object, ObjectReference, Repeat, Validity};
pub use types::outlines::{Corner, CornerKind, CurveLocal, ObjectPoint, Outline, Polyline};
pub use types::plan_view::{Geometry, Located, PlanView, ShapeKind};
pub use types::profile::{Profile, Record, Stretch, Valid};
pub use types::railroad::{Platform, PlatformSegment, RailroadStation, Switch, Track};
pub use types::road::{Road, RoadLink, RoadType, TrafficRule};
pub use types::signals::{
    Control, Controller, ElementReference, Signal, SignalBoard, SignalDependency,
    VmsBoardReference, VmsGroup,
};
pub use types::station::Station;
pub use types::strips::{CrossSectionSurface, Strip, StripMode};
pub use types::value::{ContactPoint, LayerKind, Side, is_user_data};

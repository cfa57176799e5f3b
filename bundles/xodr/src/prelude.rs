//! Names that most rules use.

pub(crate) use crate::model::{Part, Roads};
pub(crate) use crate::rules::READABLE;
pub(crate) use qcbus_document::{Document, Node};
pub(crate) use qcbus_opendrive::geometry::{
    Cubic, ParamPoly3, ParamRange, Placed, Point, heading_difference,
};
pub(crate) use qcbus_opendrive::{
    BoundarySegment, Connection, ContactPoint, CornerKind, Edge, Geometry, Junction, JunctionType,
    LaneEnd, LaneJoint, LaneRef, LayerKind, MapPart, Object, Outline, Profile, Road, RoadContact,
    RoadEnd, RoadLink, RoadMap, SectionRef, ShapeKind, Side, Station, Stretch, Traffic,
    TrafficRule, is_user_data,
};
pub(crate) use qcbus_sdk::{
    Backport, Finding, Level, Param, Place, Readers, Rule, Sink, Version, basic,
};

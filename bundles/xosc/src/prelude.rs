//! Names that most rules use.

pub(crate) use crate::model::{About as _, OfFault as _, Scene};
pub(crate) use crate::rules::READABLE;
pub(crate) use qcbus_document::{Attribute, Document, Node};
pub(crate) use qcbus_opendrive::{Road, RoadMap, Side};
pub(crate) use qcbus_openscenario::{
    Actors, CatalogKind, DataType, Declaration, Declared, Element, Entity, EntityKind, Form,
    LaneAt, Network, Resolution, Scenario, Value, ValueFaultKind, bare,
};
pub(crate) use qcbus_sdk::{Backport, Level, Param, Place, Readers, Rule, Sink, basic};

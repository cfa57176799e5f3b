//! The OpenSCENARIO model: the content of a scenario, read once and shared by all rules.
//!
//! [`Scenario`] is built from the checked document and the catalogs and the map that it refers to.
//! Rules walk it by [`Element`]s. An element is a node of a document together with the context in
//! which it is read. The context gives `$parameter` and `${expression}` their value, and applies
//! the assignments of a reference to a catalog's entry. Everything that depends on a faulty value
//! is `None`. The fault is listed once ([`Scenario::faults`]) and causes no further findings.
//! `docs/openscenario-model.md` is the guide.

pub mod expr;
pub mod places;
pub mod stage;
pub mod story;
pub mod wording;

mod queries;
mod timeline;
mod types;

pub use qcbus_schema::closest;
pub use queries::actors::Actors;
pub use queries::element::Element;
pub use queries::init::{InitAction, init_actions};
pub use queries::network::Network;
pub use queries::scenario::Scenario;
pub use timeline::{
    At, Cause, Comparison, Condition, Edge, Impossible, Logic, Moment, Plan, Priority,
    Reason as ImpossibleReason, Span, Spans, Start, State, StoryPart, Strictness, Takes, Timeline,
    Trigger,
};
pub use types::catalogs::{CatalogKind, Entry, Resolution};
pub use types::data_type::{DataType, Value, parse_double};
pub use types::date_time::{DateTime, DateTimeError};
pub use types::declaration::{Declaration, Declared, Declares};
pub use types::entities::{Entities, Entity, EntityKind, Selection};
pub use types::faults::{Dialect, ValueFault, ValueFaultKind};
pub use types::form::Form;
pub use types::inputs::{Inputs, Linked, LinkedCatalog, LinkedMap};
pub use types::reading::Reading;
pub use types::road_network::{LaneAt, RoadNetwork};
pub use types::roads_nearby::RoadsNearby;
pub use types::storyboard::{StoryElement, StoryKind, Storyboard};
pub use types::text::{bare, identifier, is_identifier};
pub use types::ways::{Stop, Way, Ways};

/// The version in a file header: major and minor.
pub type Version = (u16, u16);

/// Returns the version in the file header of a document.
pub fn version_of(document: &qcbus_document::Document<'_>) -> Option<Version> {
    let stated = qcbus_schema::version_of(document, qcbus_document::FileKind::Xosc)?;
    let part = |number: u32| u16::try_from(number).ok();
    Some((part(stated.major)?, part(stated.minor)?))
}

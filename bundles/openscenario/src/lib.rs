//! The OpenSCENARIO model: the content of a scenario, read once and shared by all rules.
//!
//! [`Scenario`] is built from the checked document and the catalogs and the map that it refers to.
//! Rules walk it by [`Element`]s. An element is a node of a document together with the context in
//! which it is read. The context gives `$parameter` and `${expression}` their value, and applies
//! the assignments of a reference to a catalog's entry. Everything that depends on a faulty value
//! is `None`. The fault is listed once ([`Scenario::faults`]) and causes no further findings.
//! `docs/openscenario-model.md` is the guide.

pub mod expr;

mod actors;
mod catalogs;
mod data_type;
mod date_time;
mod element;
mod entities;
mod faults;
mod form;
mod inputs;
mod network;
mod reading;
mod roads_nearby;
mod scenario;
mod scope;
mod storyboard;
mod text;
mod ways;

pub use actors::Actors;
pub use catalogs::{CatalogKind, Entry, Resolution};
pub use data_type::{DataType, Value, parse_double};
pub use date_time::{DateTime, DateTimeError};
pub use element::Element;
pub use entities::{Entities, Entity, EntityKind, Selection};
pub use faults::{Dialect, ValueFault, ValueFaultKind};
pub use form::Form;
pub use inputs::{Inputs, LinkedCatalog, LinkedMap};
pub use network::{LaneAt, Network, RoadNetwork};
pub use qcbus_schema::closest;
pub use reading::Reading;
pub use roads_nearby::RoadsNearby;
pub use scenario::Scenario;
pub use scope::{Declaration, Declared, Declares};
pub use storyboard::{StoryElement, StoryKind, Storyboard};
pub use text::{identifier, is_identifier};
pub use ways::{Stop, Way, Ways};

/// The version in a file header: major and minor.
pub type Version = (u16, u16);

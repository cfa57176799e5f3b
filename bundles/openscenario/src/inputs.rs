//! What a scenario is read from.

use std::sync::Arc;

use qcbus_document::{Document, FileKind};

use crate::Version;
use crate::network::RoadNetwork;

/// The documents of one check.
#[derive(Debug, Clone)]
pub struct Inputs<'d> {
    /// The document that is checked.
    pub document: Document<'d>,
    /// What its name promises.
    pub kind: FileKind,
    /// The version in its header.
    pub version: Option<Version>,
    /// The map.
    pub map: LinkedMap,
    /// The catalogs that could be read, in the order of the references.
    pub catalogs: Vec<LinkedCatalog<'d>>,
    /// Offsets of the `Directory` elements of whose catalogs not every one could be read.
    pub incomplete: Vec<u32>,
}

/// A catalog that the document's `CatalogLocations` lead to.
#[derive(Debug, Clone, Copy)]
pub struct LinkedCatalog<'d> {
    /// The document.
    pub document: Document<'d>,
    /// Offset of the first `Directory` element that leads to it.
    pub referred_at: u32,
}

/// The map that the document's `LogicFile` leads to.
#[derive(Debug, Clone)]
pub enum LinkedMap {
    /// The document names none.
    Unnamed,
    /// A name that the simulator knows, and no file.
    Simulator,
    /// It leads nowhere, or to a file that could not be read.
    NotHad,
    /// It leads to a file that is no OpenDRIVE map.
    Foreign,
    /// Its roads; whoever checks may keep them for the next scenario.
    Roads(Arc<RoadNetwork>),
}

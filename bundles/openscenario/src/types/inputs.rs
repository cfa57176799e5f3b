//! Inputs that a scenario is built from.

use std::sync::Arc;

use qcbus_document::{Document, FileKind};

use crate::Version;
use crate::types::road_network::RoadNetwork;

/// The documents of one check.
#[derive(Debug, Clone)]
pub struct Inputs<'d> {
    /// The checked document.
    pub document: Document<'d>,
    /// Kind of the file by its name.
    pub kind: FileKind,
    /// The version in its header.
    pub version: Option<Version>,
    /// The map.
    pub map: LinkedMap,
    /// The catalogs that could be read, in the order of the references.
    pub catalogs: Vec<LinkedCatalog<'d>>,
    /// Offsets of the `Directory` elements with at least one catalog that could not be read.
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
    /// The document names no map.
    Unnamed,
    /// The document names a map that only the simulator knows, not a file.
    Simulator,
    /// The reference leads nowhere, or to a file that could not be read.
    NotHad,
    /// The reference leads to a file that is no OpenDRIVE map.
    Foreign,
    /// The roads of the map. The caller may cache them for the next scenario.
    Roads(Arc<RoadNetwork>),
}

//! What a scenario is read from.

use qcbus_document::{Document, FileKind};
use qcbus_opendrive::RoadMap;

use crate::Version;

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
    pub map: LinkedMap<'d>,
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
#[derive(Debug, Clone, Copy)]
pub enum LinkedMap<'d> {
    /// The document names none.
    Unnamed,
    /// A name that the simulator knows, and no file.
    Simulator,
    /// It leads nowhere, or to a file that could not be read.
    NotHad,
    /// The document.
    Document(Document<'d>),
    /// The document with its roads.
    Roads(&'d RoadMap<'d>),
}

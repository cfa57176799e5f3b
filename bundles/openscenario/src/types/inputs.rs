//! Inputs that a scenario is built from.

use std::sync::Arc;

use qcbus_document::{Document, FileKind};
use qcbus_messages::{Absence, DocumentRole, MissingDocument};

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

/// A document that the checked one refers to.
#[derive(Debug, Clone, Copy)]
pub struct Linked<'d> {
    /// The document.
    pub document: Document<'d>,
    /// Its role.
    pub role: DocumentRole,
    /// Offset of the element that refers to it.
    pub referred_at: u32,
}

impl<'d> Inputs<'d> {
    /// Returns the inputs for a document and those that it refers to. `roads` returns the roads of
    /// the linked document with this index.
    pub fn of(
        document: Document<'d>,
        kind: FileKind,
        version: Option<Version>,
        linked: &[Linked<'d>],
        missing: &[MissingDocument],
        roads: impl FnOnce(usize) -> Option<Arc<RoadNetwork>>,
    ) -> Inputs<'d> {
        let catalogs = linked.iter().filter(|it| it.role == DocumentRole::Catalog);
        // A missing directory is left out because it cannot contain anything.
        let doubtful = missing.iter().filter(|missing| {
            missing.role == DocumentRole::Catalog
                && !matches!(missing.why, Absence::NotThere | Absence::EmptyPath)
        });
        Inputs {
            document,
            kind,
            version,
            map: map(linked, missing, roads),
            catalogs: catalogs
                .map(|linked| LinkedCatalog {
                    document: linked.document,
                    referred_at: linked.referred_at,
                })
                .collect(),
            incomplete: doubtful.map(|missing| missing.referred_at).collect(),
        }
    }
}

fn map(
    linked: &[Linked<'_>],
    missing: &[MissingDocument],
    roads: impl FnOnce(usize) -> Option<Arc<RoadNetwork>>,
) -> LinkedMap {
    let mut missing = missing.iter().filter(|it| it.role == DocumentRole::Map);
    let mut places = linked.iter().enumerate();
    if let Some((place, map)) = places.find(|(_, it)| it.role == DocumentRole::Map) {
        // The missing part of a truncated map is unknown, so a broken map is not used.
        if missing.any(|it| matches!(it.why, Absence::Broken { .. })) {
            return LinkedMap::NotHad;
        }
        return match map.document.root().is_some_and(|root| root.is("OpenDRIVE")) {
            false => LinkedMap::Foreign,
            true => roads(place).map_or(LinkedMap::NotHad, LinkedMap::Roads),
        };
    }
    match missing.next().map(|missing| &missing.why) {
        None | Some(Absence::EmptyPath) => LinkedMap::Unnamed,
        Some(Absence::SimulatorMap) => LinkedMap::Simulator,
        Some(_) => LinkedMap::NotHad,
    }
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

//! Catalogs: their locations and their entries.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::Node;

use crate::types::faults::Problem;
use crate::types::inputs::LinkedCatalog;
use crate::types::scope::ContextId;

/// Kind of the entries of a catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[expect(missing_docs, reason = "names of the standard")]
pub enum CatalogKind {
    Vehicle,
    Controller,
    Pedestrian,
    MiscObject,
    Environment,
    Maneuver,
    Trajectory,
    Route,
}

impl CatalogKind {
    /// All kinds in the order of the standard.
    pub const ALL: [CatalogKind; 8] = [
        CatalogKind::Vehicle,
        CatalogKind::Controller,
        CatalogKind::Pedestrian,
        CatalogKind::MiscObject,
        CatalogKind::Environment,
        CatalogKind::Maneuver,
        CatalogKind::Trajectory,
        CatalogKind::Route,
    ];

    /// Returns the element name of an entry.
    pub fn element(self) -> &'static str {
        match self {
            CatalogKind::Vehicle => "Vehicle",
            CatalogKind::Controller => "Controller",
            CatalogKind::Pedestrian => "Pedestrian",
            CatalogKind::MiscObject => "MiscObject",
            CatalogKind::Environment => "Environment",
            CatalogKind::Maneuver => "Maneuver",
            CatalogKind::Trajectory => "Trajectory",
            CatalogKind::Route => "Route",
        }
    }

    /// Returns the element name in `CatalogLocations`.
    pub fn location(self) -> &'static str {
        match self {
            CatalogKind::Vehicle => "VehicleCatalog",
            CatalogKind::Controller => "ControllerCatalog",
            CatalogKind::Pedestrian => "PedestrianCatalog",
            CatalogKind::MiscObject => "MiscObjectCatalog",
            CatalogKind::Environment => "EnvironmentCatalog",
            CatalogKind::Maneuver => "ManeuverCatalog",
            CatalogKind::Trajectory => "TrajectoryCatalog",
            CatalogKind::Route => "RouteCatalog",
        }
    }

    /// Returns the kinds that a reference may lead to, by the element around it. The result is
    /// empty for an element without references.
    pub fn of_reference(parent: &str) -> &'static [CatalogKind] {
        match parent {
            "ScenarioObject" | "Trailer" => &[
                CatalogKind::Vehicle,
                CatalogKind::Pedestrian,
                CatalogKind::MiscObject,
            ],
            "ObjectController" | "AssignControllerAction" | "ControllerDistributionEntry" => {
                &[CatalogKind::Controller]
            }
            "EnvironmentAction" => &[CatalogKind::Environment],
            "ManeuverGroup" => &[CatalogKind::Maneuver],
            "FollowTrajectoryAction" | "TrajectoryRef" => &[CatalogKind::Trajectory],
            "AssignRouteAction" | "RouteRef" => &[CatalogKind::Route],
            _ => &[],
        }
    }
}

/// An entry of a catalog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Entry<'d> {
    /// The `Catalog` around it.
    pub catalog: Node<'d>,
    /// The entry.
    pub node: Node<'d>,
}

/// Target of a `CatalogReference`.
#[derive(Debug, Clone, PartialEq)]
pub enum Resolution<'d> {
    /// The reference leads to this entry.
    Entry(Entry<'d>),
    /// An entry of this name exists, but its element is not allowed here.
    OtherElement(Entry<'d>),
    /// The catalog is found only in the directory of another kind.
    OtherLocation(Entry<'d>),
    /// The catalog exists but has no such entry.
    NoEntry {
        /// The catalog.
        catalog: Node<'d>,
    },
    /// All catalogs of the kind are known. None has this name.
    NoCatalog,
    /// `CatalogLocations` has no location for the kind.
    NoLocation,
    /// Not all catalogs of the kind could be read, so the target is unknown.
    NotRead,
    /// The name of the catalog or entry is unknown, or the reference is not allowed here. Other
    /// rules report both.
    Unknown,
}

/// A followed reference.
pub(crate) struct Link<'d> {
    pub(crate) resolution: Resolution<'d>,
    pub(crate) context: Option<ContextId>,
}

/// An assigned value that does not fit the parameter.
pub(crate) struct AssignmentProblem<'d> {
    pub(crate) assignment: Node<'d>,
    pub(crate) problem: Problem<'d>,
}

/// The catalogs of a scenario.
#[derive(Debug, Default)]
pub(crate) struct Catalogs<'d> {
    /// `Directory` elements by kind.
    directories: HashMap<CatalogKind, Node<'d>>,
    /// Kinds with at least one unread catalog.
    incomplete: Vec<CatalogKind>,
    /// Catalogs by name, with the kind of the directory where each was found first.
    by_name: HashMap<&'d str, Vec<(Option<CatalogKind>, Node<'d>)>>,
    entries: HashMap<Node2, HashMap<&'d str, Vec<Node<'d>>>>,
}

/// A node, by document and index.
type Node2 = (usize, u32);

fn place(node: Node<'_>) -> Node2 {
    (node.document().path().as_ptr() as usize, node.index())
}

impl<'d> Catalogs<'d> {
    pub(crate) fn new(
        root: Node<'d>,
        linked: &[LinkedCatalog<'d>],
        incomplete: &[u32],
    ) -> Catalogs<'d> {
        let mut catalogs = Catalogs::default();
        let locations = root.child("CatalogLocations");
        for kind in CatalogKind::ALL {
            let location = locations.and_then(|locations| locations.child(kind.location()));
            if let Some(directory) = location.and_then(|location| location.child("Directory")) {
                catalogs.directories.insert(kind, directory);
            }
        }
        let kind_at = |offset: u32| {
            let found = catalogs
                .directories
                .iter()
                .find(|(_, node)| node.offset() == offset);
            found.map(|(kind, _)| *kind)
        };
        let unread: Vec<CatalogKind> = incomplete.iter().filter_map(|at| kind_at(*at)).collect();
        let found: Vec<_> = linked
            .iter()
            .map(|one| (kind_at(one.referred_at), one.document))
            .collect();
        // A file in several directories is listed with the first one only. A kind whose directory
        // has no files of its own may share those of another.
        catalogs.incomplete = unread;
        for (kind, document) in found {
            let root = document.root();
            for catalog in root
                .into_iter()
                .flat_map(|root| root.children_named("Catalog"))
            {
                catalogs.add(kind, catalog);
            }
        }
        catalogs
    }

    fn add(&mut self, kind: Option<CatalogKind>, catalog: Node<'d>) {
        let name = catalog.attr("name").unwrap_or("");
        self.by_name.entry(name).or_default().push((kind, catalog));
        let mut entries: HashMap<&'d str, Vec<Node<'d>>> = HashMap::new();
        for entry in catalog.children() {
            if let Some(name) = entry.attr("name") {
                entries.entry(name).or_default().push(entry);
            }
        }
        self.entries.insert(place(catalog), entries);
    }

    fn entries_named(&self, catalog: Node<'d>, name: &str) -> &[Node<'d>] {
        let entries = self.entries.get(&place(catalog));
        entries
            .and_then(|entries| entries.get(name))
            .map_or(&[], Vec::as_slice)
    }

    pub(crate) fn find(
        &self,
        kinds: &[CatalogKind],
        catalog_name: &str,
        entry_name: &str,
    ) -> Resolution<'d> {
        let located = kinds.iter().any(|kind| self.directories.contains_key(kind));
        let named = self
            .by_name
            .get(catalog_name)
            .map_or(&[][..], Vec::as_slice);
        let mut other = None;
        let mut first = None;
        for (found_for, catalog) in named {
            first = first.or(Some(*catalog));
            for node in self.entries_named(*catalog, entry_name) {
                let entry = Entry {
                    catalog: *catalog,
                    node: *node,
                };
                let fits = kinds.iter().find(|kind| node.is(kind.element()));
                let Some(kind) = fits else {
                    other = other.or(Some(entry));
                    continue;
                };
                let here = self.shares(*kind, *found_for);
                return if here {
                    Resolution::Entry(entry)
                } else {
                    Resolution::OtherLocation(entry)
                };
            }
        }
        let unread = kinds.iter().any(|kind| self.incomplete.contains(kind));
        match (other, first) {
            (Some(entry), _) => Resolution::OtherElement(entry),
            _ if unread => Resolution::NotRead,
            (None, Some(catalog)) => Resolution::NoEntry { catalog },
            (None, None) if located => Resolution::NoCatalog,
            (None, None) => Resolution::NoLocation,
        }
    }

    /// Checks whether a catalog that was found for one kind lies in the directory of another kind.
    fn shares(&self, kind: CatalogKind, found_for: Option<CatalogKind>) -> bool {
        let Some(found_for) = found_for.filter(|found_for| *found_for != kind) else {
            return true;
        };
        let path = |kind| {
            let directory: &Node<'d> = self.directories.get(&kind)?;
            directory
                .attr("path")
                .map(|path| path.trim_end_matches(['/', '\\']).trim_start_matches("./"))
        };
        match (path(kind), path(found_for)) {
            // Two parameters may resolve to the same directory.
            (Some(one), Some(other)) => one == other || one.contains('$') || other.contains('$'),
            _ => false,
        }
    }

    pub(crate) fn directory(&self, kind: CatalogKind) -> Option<Node<'d>> {
        self.directories.get(&kind).copied()
    }

    pub(crate) fn all(
        &self,
    ) -> impl Iterator<Item = (&'d str, &[(Option<CatalogKind>, Node<'d>)])> {
        self.by_name
            .iter()
            .map(|(name, found)| (*name, found.as_slice()))
    }
}

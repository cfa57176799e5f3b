//! Catalogs: their locations, their entries and the targets of references.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::Node;

use crate::element::Element;
use crate::faults::{Problem, ValueFaultKind};
use crate::inputs::LinkedCatalog;
use crate::reading::{Expected, resolve};
use crate::scenario::Scenario;
use crate::scope::{Context, ContextId, Declared};

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

/// Maximum depth of references from entry to entry.
const MAX_DEPTH: u32 = 8;
/// Maximum number of followed references.
const MAX_REFERENCES: usize = 50_000;

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

    fn find(&self, kinds: &[CatalogKind], catalog_name: &str, entry_name: &str) -> Resolution<'d> {
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

impl<'d> Scenario<'d> {
    /// Follows every reference to a catalog, including references within entries.
    pub(crate) fn follow_references(&mut self) {
        let mut next = 0;
        while next < self.contexts() && self.contexts() < MAX_REFERENCES {
            let context = u32::try_from(next).unwrap_or(0);
            next += 1;
            let (top, depth) = (self.context(context).top, self.context(context).depth);
            for reference in top.descendants_named("CatalogReference") {
                let link = self.follow(reference, context, depth);
                self.links.insert((context, reference.index()), link);
            }
        }
    }

    fn follow(&mut self, reference: Node<'d>, context: ContextId, depth: u32) -> Link<'d> {
        let element = Element {
            scenario: self,
            node: reference,
            context,
        };
        let parent = reference.parent().map_or("", |parent| parent.name());
        let kinds = CatalogKind::of_reference(parent);
        let names = element.text("catalogName").zip(element.text("entryName"));
        let resolution = match names {
            Some((catalog, entry)) if !kinds.is_empty() => {
                self.catalogs.find(kinds, &catalog, &entry)
            }
            _ => Resolution::Unknown,
        };
        let context = match &resolution {
            Resolution::Entry(entry) | Resolution::OtherLocation(entry) if depth < MAX_DEPTH => {
                Some(self.enter(reference, context, depth, entry.node))
            }
            _ => None,
        };
        Link {
            resolution,
            context,
        }
    }

    fn enter(
        &mut self,
        reference: Node<'d>,
        outer: ContextId,
        depth: u32,
        entry: Node<'d>,
    ) -> ContextId {
        let mut assigned: HashMap<&'d str, Declared<'d>> = HashMap::new();
        for assignment in assignments(reference) {
            let Some((name, value)) = self.assigned(assignment, outer, entry) else {
                continue;
            };
            assigned.entry(name).or_insert(value);
        }
        let (mut context, _) = Context::new(entry, self.version(), &assigned);
        context.reference = Some((reference, outer));
        context.depth = depth + 1;
        self.push_context(context)
    }

    /// Returns the parameter of an assignment, and its value in the type that the entry declares.
    fn assigned(
        &mut self,
        assignment: Node<'d>,
        outer: ContextId,
        entry: Node<'d>,
    ) -> Option<(&'d str, Declared<'d>)> {
        let name = assignment.attr("parameterRef")?;
        let name = name.strip_prefix('$').unwrap_or(name);
        let declared = declaration(entry, name)?;
        let data_type = declared
            .attr("parameterType")
            .and_then(crate::DataType::of_declaration);
        let expected = data_type.map_or(Expected::Unknown, Expected::Type);
        let raw = assignment.attr("value")?;
        let read_in = self.context(outer);
        match resolve(raw, expected, self.version(), &|name| {
            read_in.get(assignment, name)
        }) {
            Ok(value) => Some((name, Declared::Value(value))),
            Err(mut problem) => {
                let value = problem.value.take();
                let about_type = matches!(
                    problem.kind,
                    ValueFaultKind::Declared
                        | ValueFaultKind::Parameter
                        | ValueFaultKind::Result
                        | ValueFaultKind::Narrowed
                );
                if about_type && outer == 0 {
                    self.assignment_problems.push(AssignmentProblem {
                        assignment,
                        problem,
                    });
                }
                Some((name, value.map_or(Declared::Faulty, Declared::Value)))
            }
        }
    }

    /// Returns the target of a `CatalogReference`.
    pub fn resolution(&self, reference: Element<'_, 'd>) -> &Resolution<'d> {
        let link = self.links.get(&(reference.context, reference.node.index()));
        link.map_or(&Resolution::Unknown, |link| &link.resolution)
    }

    /// Returns the entry that a `CatalogReference` leads to, with the assigned parameters applied.
    pub fn entry(&self, reference: Element<'_, 'd>) -> Option<Element<'_, 'd>> {
        let context = self
            .links
            .get(&(reference.context, reference.node.index()))?
            .context?;
        Some(Element {
            scenario: self,
            node: self.context(context).top,
            context,
        })
    }

    /// Returns the `Directory` element for the catalogs of a kind.
    pub fn catalog_directory(&self, kind: CatalogKind) -> Option<Element<'_, 'd>> {
        self.catalogs.directory(kind).map(|node| self.element(node))
    }

    /// Returns all catalogs that were read, with the kind of their directory, in no order.
    pub fn catalogs(&self) -> impl Iterator<Item = (Option<CatalogKind>, Node<'d>)> {
        self.catalogs
            .all()
            .flat_map(|(_, found)| found.iter().copied())
    }

    /// Returns assigned values that do not fit the parameter of the entry: the
    /// `ParameterAssignment` and the fault, in document order.
    pub fn assignment_faults(
        &self,
    ) -> impl Iterator<Item = (Element<'_, 'd>, ValueFaultKind, &str)> {
        self.assignment_problems.iter().map(|one| {
            (
                self.element(one.assignment),
                one.problem.kind,
                one.problem.text.as_str(),
            )
        })
    }
}

impl<'m, 'd> Element<'m, 'd> {
    /// Returns the child with one of these names. Otherwise returns the entry with one of these
    /// names that a `CatalogReference` in its place leads to.
    pub fn child_or_entry(self, names: &[&str]) -> Option<Element<'m, 'd>> {
        let own = self.children().find(|child| names.contains(&child.name()));
        own.or_else(|| {
            let references = self.children_named("CatalogReference");
            let mut entries = references.filter_map(|reference| self.scenario.entry(reference));
            entries.find(|entry| names.contains(&entry.name()))
        })
    }
}

/// Returns the assignments of a reference.
pub(crate) fn assignments(reference: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    let block = reference.child("ParameterAssignments");
    block
        .into_iter()
        .flat_map(|block| block.children_named("ParameterAssignment"))
}

/// Returns the declaration of a parameter by the entry itself.
fn declaration<'d>(entry: Node<'d>, name: &str) -> Option<Node<'d>> {
    let block = entry.child("ParameterDeclarations")?;
    block.children_named("ParameterDeclaration").find(|one| {
        one.attr("name")
            .is_some_and(|own| own.strip_prefix('$').unwrap_or(own) == name)
    })
}

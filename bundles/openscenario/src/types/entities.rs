//! Entities: scenario objects, trailers, and selections of them.

use std::borrow::Cow;

use foldhash::{HashMap, HashSet, HashSetExt as _};
use qcbus_document::Node;

use crate::types::scope::ContextId;

/// Kind of an entity.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum EntityKind {
    /// `Vehicle`
    Vehicle,
    /// `Pedestrian`
    Pedestrian,
    /// `MiscObject`
    MiscObject,
    /// `ExternalObjectReference`: only the simulator knows the kind.
    External,
    /// Unknown kind: the catalog entry was not found, or the entity has no object.
    Unknown,
}

impl EntityKind {
    /// Returns the name of the element.
    pub fn element(self) -> &'static str {
        match self {
            EntityKind::Vehicle => "Vehicle",
            EntityKind::Pedestrian => "Pedestrian",
            EntityKind::MiscObject => "MiscObject",
            EntityKind::External => "ExternalObjectReference",
            EntityKind::Unknown => "unknown object",
        }
    }
}

/// A scenario object.
#[derive(Debug, Clone)]
pub struct Entity<'d> {
    pub(crate) node: Node<'d>,
    pub(crate) context: ContextId,
    pub(crate) name: Cow<'d, str>,
    pub(crate) kind: EntityKind,
    pub(crate) object: Option<(Node<'d>, ContextId)>,
}

impl<'d> Entity<'d> {
    /// Returns its name with parameters replaced.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns its kind.
    pub fn kind(&self) -> EntityKind {
        self.kind
    }
}

/// A selection of entities.
#[derive(Debug, Clone)]
pub struct Selection<'d> {
    pub(crate) node: Node<'d>,
    pub(crate) name: Cow<'d, str>,
    pub(crate) members: Vec<Cow<'d, str>>,
    pub(crate) types: Vec<Cow<'d, str>>,
}

impl<'d> Selection<'d> {
    /// Returns its name with parameters replaced.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the names of the members that it lists.
    pub fn members(&self) -> impl Iterator<Item = &str> {
        self.members.iter().map(|name| &**name)
    }

    /// Returns the types by which it selects members (`vehicle`, `pedestrian`, …).
    pub fn types(&self) -> impl Iterator<Item = &str> {
        self.types.iter().map(|name| &**name)
    }
}

/// All entities and selections.
#[derive(Debug, Default)]
pub struct Entities<'d> {
    objects: Vec<Entity<'d>>,
    selections: Vec<Selection<'d>>,
    object_names: HashMap<String, u32>,
    selection_names: HashMap<String, u32>,
}

impl<'d> Entities<'d> {
    pub(crate) fn add(&mut self, object: Entity<'d>) {
        let at = u32::try_from(self.objects.len()).unwrap_or(u32::MAX);
        let name = object.name().to_owned();
        self.object_names.entry(name).or_insert(at);
        self.objects.push(object);
    }

    pub(crate) fn add_selection(&mut self, selection: Selection<'d>) {
        let at = u32::try_from(self.selections.len()).unwrap_or(u32::MAX);
        let name = selection.name().to_owned();
        self.selection_names.entry(name).or_insert(at);
        self.selections.push(selection);
    }

    /// Returns the scenario objects in document order.
    pub fn objects(&self) -> &[Entity<'d>] {
        &self.objects
    }

    /// Returns the selections in document order.
    pub fn selections(&self) -> &[Selection<'d>] {
        &self.selections
    }

    /// Returns the first scenario object of this name.
    pub fn object(&self, name: &str) -> Option<&Entity<'d>> {
        self.objects.get(*self.object_names.get(name)? as usize)
    }

    /// Returns the first selection of this name.
    pub fn selection(&self, name: &str) -> Option<&Selection<'d>> {
        self.selections
            .get(*self.selection_names.get(name)? as usize)
    }

    /// Checks whether a scenario object or a selection of this name exists.
    pub fn contains(&self, name: &str) -> bool {
        self.object_names.contains_key(name) || self.selection_names.contains_key(name)
    }

    /// Returns all names.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let objects = self.objects.iter().map(Entity::name);
        objects.chain(self.selections.iter().map(Selection::name))
    }

    /// Returns the scenario objects that a name stands for. This is the object itself, or the
    /// members of a selection and of the selections within it. Returns `None` if a part of it is
    /// unknown.
    pub fn expand(&self, name: &str) -> Option<Vec<&Entity<'d>>> {
        let mut found = Vec::new();
        let mut seen: HashSet<&str> = HashSet::new();
        let mut open = vec![name];
        while let Some(name) = open.pop() {
            if let Some(object) = self.object(name) {
                if !found
                    .iter()
                    .any(|other: &&Entity<'d>| other.node == object.node)
                {
                    found.push(object);
                }
                continue;
            }
            let selection = self.selection(name)?;
            if !seen.insert(selection.name()) {
                continue;
            }
            open.extend(selection.members());
            for wanted in selection.types() {
                found.extend(
                    self.objects
                        .iter()
                        .filter(|object| is_of_type(object.kind, wanted)),
                );
            }
        }
        Some(found)
    }
}

/// Checks whether an entity is of an `objectType`.
fn is_of_type(kind: EntityKind, object_type: &str) -> bool {
    match object_type {
        "vehicle" => kind == EntityKind::Vehicle,
        "pedestrian" => kind == EntityKind::Pedestrian,
        // The standard uses `miscellaneous`. Some of its examples use `misc`.
        "miscellaneous" | "misc" => kind == EntityKind::MiscObject,
        "external" => kind == EntityKind::External,
        _ => false,
    }
}

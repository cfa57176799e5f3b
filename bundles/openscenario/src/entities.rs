//! Entities: scenario objects, trailers, and selections of them.

use std::borrow::Cow;

use foldhash::{HashMap, HashSet, HashSetExt as _};
use qcbus_document::Node;

use crate::element::Element;
use crate::scenario::Scenario;
use crate::scope::ContextId;

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
    node: Node<'d>,
    context: ContextId,
    name: Cow<'d, str>,
    kind: EntityKind,
    object: Option<(Node<'d>, ContextId)>,
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

    /// Returns the `ScenarioObject`.
    pub fn element<'m>(&self, scenario: &'m Scenario<'d>) -> Element<'m, 'd> {
        Element {
            scenario,
            node: self.node,
            context: self.context,
        }
    }

    /// Returns the `Vehicle`, `Pedestrian` or `MiscObject`, from the document or from a catalog
    /// entry.
    pub fn object<'m>(&self, scenario: &'m Scenario<'d>) -> Option<Element<'m, 'd>> {
        let (node, context) = self.object?;
        Some(Element {
            scenario,
            node,
            context,
        })
    }
}

/// A selection of entities.
#[derive(Debug, Clone)]
pub struct Selection<'d> {
    node: Node<'d>,
    name: Cow<'d, str>,
    members: Vec<Cow<'d, str>>,
    types: Vec<Cow<'d, str>>,
}

impl<'d> Selection<'d> {
    /// Returns its name with parameters replaced.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the `EntitySelection`.
    pub fn element<'m>(&self, scenario: &'m Scenario<'d>) -> Element<'m, 'd> {
        scenario.element(self.node)
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

/// Elements that may be the object of a `ScenarioObject`.
const OBJECTS: [&str; 4] = [
    "Vehicle",
    "Pedestrian",
    "MiscObject",
    "ExternalObjectReference",
];

impl<'d> Entities<'d> {
    pub(crate) fn of(scenario: &Scenario<'d>) -> Entities<'d> {
        let mut entities = Entities::default();
        let block = scenario.root().child("Entities");
        for child in block.into_iter().flat_map(Element::children) {
            match child.name() {
                "ScenarioObject" => entities.add(child, 0),
                "EntitySelection" => entities.add_selection(child),
                _ => {}
            }
        }
        entities
    }

    fn add(&mut self, element: Element<'_, 'd>, depth: usize) {
        let object = element.child_or_entry(&OBJECTS);
        let kind = match object.map(Element::name) {
            Some("Vehicle") => EntityKind::Vehicle,
            Some("Pedestrian") => EntityKind::Pedestrian,
            Some("MiscObject") => EntityKind::MiscObject,
            Some("ExternalObjectReference") => EntityKind::External,
            _ => EntityKind::Unknown,
        };
        if let Some(name) = element.text("name") {
            let at = u32::try_from(self.objects.len()).unwrap_or(u32::MAX);
            self.object_names.entry(name.to_string()).or_insert(at);
            self.objects.push(Entity {
                node: element.node,
                context: element.context,
                name,
                kind,
                object: object.map(|object| (object.node, object.context)),
            });
        }
        // A trailer that is defined inside its vehicle is a separate entity (1.3).
        let trailer = object.and_then(|object| object.path(&["Trailer", "Trailer"]));
        if let Some(trailer) = trailer.filter(|_| depth < 16) {
            self.add(trailer, depth + 1);
        }
    }

    fn add_selection(&mut self, element: Element<'_, 'd>) {
        let Some(name) = element.text("name") else {
            return;
        };
        let members = element.child("Members");
        let all = || members.into_iter().flat_map(Element::children);
        let named = |wanted: &'static str, attribute: &'static str| {
            all()
                .filter(|child| child.is(wanted))
                .filter_map(|child| child.text(attribute))
                .collect()
        };
        let at = u32::try_from(self.selections.len()).unwrap_or(u32::MAX);
        self.selection_names.entry(name.to_string()).or_insert(at);
        self.selections.push(Selection {
            node: element.node,
            name,
            members: named("EntityRef", "entityRef"),
            types: named("ByType", "objectType"),
        });
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

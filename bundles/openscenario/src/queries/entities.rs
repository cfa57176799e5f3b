//! The entities of a scenario, with objects from catalogs.

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::entities::{Entities, Entity, EntityKind, Selection};

impl<'d> Scenario<'d> {
    /// Returns the entities and selections.
    pub fn entities(&self) -> &Entities<'d> {
        self.entities.get_or_init(|| {
            let mut entities = Entities::default();
            let block = self.root().child("Entities");
            for child in block.into_iter().flat_map(Element::children) {
                match child.name() {
                    "ScenarioObject" => add(&mut entities, child, 0),
                    "EntitySelection" => {
                        if let Some(selection) = selection(child) {
                            entities.add_selection(selection);
                        }
                    }
                    _ => {}
                }
            }
            entities
        })
    }
}

impl<'d> Entity<'d> {
    /// Returns the `ScenarioObject`.
    pub fn element<'m>(&self, scenario: &'m Scenario<'d>) -> Element<'m, 'd> {
        scenario.element_in(self.context, self.node)
    }

    /// Returns the `Vehicle`, `Pedestrian` or `MiscObject`, from the document or from a catalog
    /// entry.
    pub fn object<'m>(&self, scenario: &'m Scenario<'d>) -> Option<Element<'m, 'd>> {
        let (node, context) = self.object?;
        Some(scenario.element_in(context, node))
    }
}

impl<'d> Selection<'d> {
    /// Returns the `EntitySelection`.
    pub fn element<'m>(&self, scenario: &'m Scenario<'d>) -> Element<'m, 'd> {
        scenario.element(self.node)
    }
}

/// Elements that may be the object of a `ScenarioObject`.
const OBJECTS: [&str; 4] = [
    "Vehicle",
    "Pedestrian",
    "MiscObject",
    "ExternalObjectReference",
];

fn add<'d>(entities: &mut Entities<'d>, element: Element<'_, 'd>, depth: usize) {
    let object = element.child_or_entry(&OBJECTS);
    let kind = match object.map(Element::name) {
        Some("Vehicle") => EntityKind::Vehicle,
        Some("Pedestrian") => EntityKind::Pedestrian,
        Some("MiscObject") => EntityKind::MiscObject,
        Some("ExternalObjectReference") => EntityKind::External,
        _ => EntityKind::Unknown,
    };
    if let Some(name) = element.text("name") {
        entities.add(Entity {
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
        add(entities, trailer, depth + 1);
    }
}

fn selection<'d>(element: Element<'_, 'd>) -> Option<Selection<'d>> {
    let name = element.text("name")?;
    let members = element.child("Members");
    let all = || members.into_iter().flat_map(Element::children);
    let named = |wanted: &'static str, attribute: &'static str| {
        all()
            .filter(|child| child.is(wanted))
            .filter_map(|child| child.text(attribute))
            .collect()
    };
    Some(Selection {
        node: element.node,
        name,
        members: named("EntityRef", "entityRef"),
        types: named("ByType", "objectType"),
    })
}

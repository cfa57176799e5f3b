//! Groups in the expanded scenario that come from other files, and the origins of their values.

use std::collections::HashMap;

use crate::assembly::Assembly;
use crate::prelude::*;
use qcbus_messages::DocumentRole;
use qcbus_messages::path_text::name_of;
use qcbus_openscenario::{Inputs, LinkedCatalog, LinkedMap, Scenario};
use qcbus_schema::Version;
use qcbus_sdk::modular::Copy;
use qcbus_sdk::modular::Value;
use qcbus_sdk::modular::offered;

/// A group of another file in the expanded scenario, with the reference that takes it.
#[derive(Clone, Copy)]
pub struct Taken<'a, 'd> {
    /// The reference in the root that takes the group.
    pub reference: &'a Followed<'d>,
    /// The use within the reference.
    pub one: &'a Use<'d>,
    /// The group with its replaced values.
    pub copy: &'a Copy<'d>,
}

impl<'d> Taken<'_, 'd> {
    /// Returns the spot at which the root takes the group.
    pub fn at(&self) -> Spot<'d> {
        taken_at(self.reference, self.one)
    }

    /// Returns the name of the group in its own file.
    pub fn own_name(&self) -> &'d str {
        self.copy.group.attr("name").unwrap_or("")
    }

    /// Returns the elements of the group, with the group itself first.
    pub fn elements(&self) -> impl Iterator<Item = Node<'d>> + use<'d> {
        std::iter::once(self.copy.group).chain(self.copy.group.descendants())
    }

    /// Returns the attributes with their resulting values, except those that only concern
    /// expansion.
    pub fn values(&self) -> impl Iterator<Item = (Attribute<'d>, &str)> {
        let attributes = self.elements().flat_map(|node| node.attributes());
        attributes
            .filter(|attribute| !attribute.is(OFFERS))
            .map(|attribute| (attribute, self.value(attribute)))
    }

    /// Returns the resulting value of an attribute.
    pub fn value<'s>(&'s self, attribute: Attribute<'d>) -> &'s str {
        match self.copy.edit(attribute) {
            Some(value) => &value.text,
            None => attribute.value(),
        }
    }

    /// Returns the attributes with replaced values, except the name of the group.
    pub fn edited(&self) -> impl Iterator<Item = (Attribute<'d>, &Value)> {
        let is_edited = !self.copy.edits.is_empty();
        let elements = self.elements().filter(move |_| is_edited);
        let attributes = elements.flat_map(|node| node.attributes());
        attributes.filter_map(|attribute| {
            let value = self.copy.edits.get(&attribute.offset())?;
            Some((attribute, value))
        })
    }
}

/// Returns the spot at which a referring file names the groups that it takes.
pub fn taken_at<'d>(reference: &Followed<'d>, one: &Use<'d>) -> Spot<'d> {
    match one.node == reference.node {
        true => Spot::of(reference.node, "scenarioFileName"),
        false => Spot::of(one.node, "maneuverGroupName"),
    }
}

impl<'d> Assembly<'d> {
    /// Returns the groups of other files in the expanded scenario, in the order of the references.
    pub fn taken(&self) -> impl Iterator<Item = Taken<'_, 'd>> {
        let of_root = self.expansion.references.iter();
        let of_root = of_root.filter(|reference| reference.piece == 0);
        of_root.flat_map(|reference| {
            reference.uses.iter().flat_map(move |one| {
                let copies = one.copies.iter();
                copies.map(move |copy| Taken {
                    reference,
                    one,
                    copy,
                })
            })
        })
    }

    /// Returns the document of a piece.
    pub fn piece(&self, piece: usize) -> Document<'d> {
        let pieces = &self.expansion.pieces;
        pieces
            .get(piece)
            .map_or(self.root(), |piece| piece.document)
    }

    /// Returns the referring scenario as it is written, with its catalogs and declarations.
    pub fn declaring(&self) -> Option<Scenario<'d>> {
        let catalogs = self.subject.with_role(DocumentRole::Catalog);
        Scenario::new(&Inputs {
            document: self.root(),
            kind: FileKind::Xosc,
            version: self
                .subject
                .version()
                .map(|version| (version.major, version.minor)),
            map: LinkedMap::NotHad,
            catalogs: catalogs
                .map(|linked| LinkedCatalog {
                    document: linked.document,
                    referred_at: linked.referred_at,
                })
                .collect(),
            incomplete: Vec::new(),
        })
    }

    /// Returns the version that the header of a document names.
    pub fn version_of(&self, document: Document<'d>) -> Option<Version> {
        qcbus_schema::version_of(&document, FileKind::Xosc)
    }
}

/// Returns the file name of a document. For an archive member, the archive's name is included.
pub fn short_name<'d>(document: Document<'d>) -> &'d str {
    name_of(document.path())
}

/// The place at which a replacing value is written.
#[derive(Clone, Copy)]
pub enum WrittenAt<'d> {
    /// The value of a `ParameterReference`: its key and the attribute.
    Key(&'d str, Attribute<'d>),
    /// The actor of a referring group.
    Actor(Attribute<'d>),
}

impl<'d> WrittenAt<'d> {
    /// Returns the attribute that holds the value.
    pub fn attribute(self) -> Attribute<'d> {
        match self {
            WrittenAt::Key(_, attribute) | WrittenAt::Actor(attribute) => attribute,
        }
    }

    /// Returns the name of the value for messages.
    pub fn what(self) -> String {
        match self {
            WrittenAt::Key(key, _) => format!("the key `{key}`"),
            WrittenAt::Actor(_) => "the actor of the referring group".to_owned(),
        }
    }
}

/// The places at which referring files write their values.
pub struct WrittenIn<'d>(HashMap<(usize, u32), WrittenAt<'d>>);

impl<'d> WrittenIn<'d> {
    /// Collects the places of all referring files.
    pub fn of(assembly: &Assembly<'d>) -> WrittenIn<'d> {
        let mut origins = HashMap::new();
        for reference in &assembly.expansion.references {
            let actors = reference.group.children_named("Actors");
            let actors = actors.flat_map(|actors| actors.children());
            for actor in actors.filter_map(|actor| actor.attribute("entityRef")) {
                let at = (reference.piece, actor.value_offset());
                origins.insert(at, WrittenAt::Actor(actor));
            }
            for key in reference.uses.iter().flat_map(|one| &one.keys) {
                let at = (reference.piece, key.value.value_offset());
                origins.insert(at, WrittenAt::Key(key.key, key.value));
            }
        }
        WrittenIn(origins)
    }

    /// Returns the place at which a value is written.
    pub fn get(&self, value: &Value) -> Option<WrittenAt<'d>> {
        self.0.get(&(value.piece, value.offset)).copied()
    }

    /// Returns the place at which the value of an attribute is written, if it was replaced.
    pub fn of_attribute(
        &self,
        taken: &Taken<'_, 'd>,
        attribute: Attribute<'d>,
    ) -> Option<WrittenAt<'d>> {
        self.get(taken.copy.edit(attribute)?)
    }
}

/// Returns the shortest key with the attribute's element: `AbsoluteTargetSpeed.value`.
pub fn key_of(attribute: Attribute<'_>) -> String {
    format!("{}.{}", attribute.node().name(), attribute.name())
}

/// Checks whether a key may set the value of an attribute.
pub fn is_offered(attribute: Attribute<'_>) -> bool {
    offered(attribute.node()).any(|one| one.offset() == attribute.offset())
}

/// Returns the name of the parameter if the whole value is `$name`.
pub fn parameter_of(value: &str) -> Option<&str> {
    let name = value.trim().strip_prefix('$')?;
    qcbus_openscenario::is_identifier(name).then_some(name)
}

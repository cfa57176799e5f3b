//! The groups that end up in the expanded scenario, and where their values are written.

use std::collections::HashMap;

use qcbus_document::{Attribute, Document, FileKind, Node};
use qcbus_messages::DocumentRole;
use qcbus_messages::path_text::name_of;
use qcbus_openscenario::{Inputs, LinkedCatalog, LinkedMap, Scenario};
use qcbus_schema::Version;
use qcbus_sdk::modular::{Copy, Followed, OFFERS, Spot, Use, Value, offered};

use crate::assembly::Assembly;

/// A group of another file in the expanded scenario, and who takes it.
#[derive(Clone, Copy)]
pub struct Taken<'a, 'd> {
    /// The reference of the root that takes it.
    pub reference: &'a Followed<'d>,
    /// Which of the things that the reference takes.
    pub one: &'a Use<'d>,
    /// The group with what is replaced in it.
    pub copy: &'a Copy<'d>,
}

impl<'d> Taken<'_, 'd> {
    /// Where the root says that the group is taken.
    pub fn at(&self) -> Spot<'d> {
        taken_at(self.reference, self.one)
    }

    /// What the group is called in its own file.
    pub fn own_name(&self) -> &'d str {
        self.copy.group.attr("name").unwrap_or("")
    }

    /// The elements of the group, itself first.
    pub fn elements(&self) -> impl Iterator<Item = Node<'d>> + use<'d> {
        std::iter::once(self.copy.group).chain(self.copy.group.descendants())
    }

    /// The attributes with the values that they get; what only concerns expansion is left out.
    pub fn values(&self) -> impl Iterator<Item = (Attribute<'d>, &str)> {
        let attributes = self.elements().flat_map(|node| node.attributes());
        attributes
            .filter(|attribute| !attribute.is(OFFERS))
            .map(|attribute| (attribute, self.value(attribute)))
    }

    /// The value that an attribute gets.
    pub fn value<'s>(&'s self, attribute: Attribute<'d>) -> &'s str {
        match self.copy.edit(attribute) {
            Some(value) => &value.text,
            None => attribute.value(),
        }
    }

    /// The attributes whose values are replaced, but for the group's name.
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

/// Where a referring file says what it takes.
pub fn taken_at<'d>(reference: &Followed<'d>, one: &Use<'d>) -> Spot<'d> {
    match one.node == reference.node {
        true => Spot::of(reference.node, "scenarioFileName"),
        false => Spot::of(one.node, "maneuverGroupName"),
    }
}

impl<'d> Assembly<'d> {
    /// The groups of other files that are in the expanded scenario, in the order in which they are
    /// referred to.
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

    /// The document of a piece.
    pub fn piece(&self, piece: usize) -> Document<'d> {
        let pieces = &self.expansion.pieces;
        pieces
            .get(piece)
            .map_or(self.root(), |piece| piece.document)
    }

    /// The scenario that refers to the others, as it is written, with its catalogs: what it declares.
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

    /// The version that the header of a document names.
    pub fn version_of(&self, document: Document<'d>) -> Option<Version> {
        qcbus_schema::version_of(&document, FileKind::Xosc)
    }
}

/// What people call a document: its file's name, of a member with that of its archive.
pub fn short_name<'d>(document: Document<'d>) -> &'d str {
    name_of(document.path())
}

/// A value that replaces another, where it is written.
#[derive(Clone, Copy)]
pub enum WrittenAt<'d> {
    /// The value of a `ParameterReference`: its key, and the attribute.
    Key(&'d str, Attribute<'d>),
    /// The actor of a referring group.
    Actor(Attribute<'d>),
}

impl<'d> WrittenAt<'d> {
    /// The attribute that has the value.
    pub fn attribute(self) -> Attribute<'d> {
        match self {
            WrittenAt::Key(_, attribute) | WrittenAt::Actor(attribute) => attribute,
        }
    }

    /// What messages call it.
    pub fn what(self) -> String {
        match self {
            WrittenAt::Key(key, _) => format!("the key `{key}`"),
            WrittenAt::Actor(_) => "the actor of the referring group".to_owned(),
        }
    }
}

/// Where the values are written that referring files give.
pub struct WrittenIn<'d>(HashMap<(usize, u32), WrittenAt<'d>>);

impl<'d> WrittenIn<'d> {
    /// Those of all referring files.
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

    /// Where a value comes from.
    pub fn get(&self, value: &Value) -> Option<WrittenAt<'d>> {
        self.0.get(&(value.piece, value.offset)).copied()
    }
}

/// The shortest key that tells an attribute's element: `AbsoluteTargetSpeed.value`.
pub fn key_of(attribute: Attribute<'_>) -> String {
    format!("{}.{}", attribute.node().name(), attribute.name())
}

/// Whether an attribute may be given a value by a key.
pub fn is_offered(attribute: Attribute<'_>) -> bool {
    offered(attribute.node()).any(|one| one.offset() == attribute.offset())
}

/// The parameter that a whole value stands for: `$name`.
pub fn parameter_of(value: &str) -> Option<&str> {
    let name = value.trim().strip_prefix('$')?;
    qcbus_openscenario::is_identifier(name).then_some(name)
}

//! The compiled tables of a schema, in the form that the validator needs.
//!
//! Types refer to each other by number. Every content model is a deterministic automaton over child
//! names (or, for `all`, a bit per child). Therefore the validator decides each child with one
//! lookup and without backtracking.

use crate::assertion::Assertion;
use crate::constraint::Constraints;
use crate::edition::Edition;
use crate::names::{NameId, Names};
use crate::simple::SimpleType;

/// One compiled schema.
#[derive(Clone, Debug)]
pub struct Schema {
    /// Title used in messages, e.g. `OpenDRIVE 1.7`.
    pub title: Box<str>,
    /// XSD 1.0 or 1.1.
    pub edition: Edition,
    /// Target namespace of the source schema. Validation ignores it, but notes mention it.
    pub namespace: Option<Box<str>>,
    /// All element and attribute names.
    pub names: Names,
    /// Simple types, referred to by number.
    pub simple: Vec<SimpleType>,
    /// Complex types, referred to by number.
    pub complex: Vec<ComplexType>,
    /// Elements that may be the root of a document.
    pub roots: Vec<ElementDecl>,
}

impl Schema {
    /// Creates an empty schema with a title.
    pub(crate) fn new(title: &str) -> Self {
        Self {
            title: title.into(),
            edition: Edition::V1_0,
            namespace: None,
            names: Names::default(),
            simple: Vec::new(),
            complex: Vec::new(),
            roots: Vec::new(),
        }
    }

    /// Returns the declaration of a root element.
    pub fn root(&self, name: &str) -> Option<&ElementDecl> {
        let id = self.names.find(name)?;
        self.roots.iter().find(|root| root.name == id)
    }

    /// Checks whether elements named `parent` may contain children named `child`.
    pub(crate) fn knows_child(&self, parent: &str, child: &str) -> bool {
        let (Some(parent), Some(child)) = (self.names.find(parent), self.names.find(child)) else {
            return false;
        };
        let mut homes = self.declared().filter(|element| element.name == parent);
        homes.any(|element| self.is_home(element, child))
    }

    /// Returns all declarations of elements.
    fn declared(&self) -> impl Iterator<Item = &ElementDecl> {
        let within = self.complex.iter().flat_map(|ty| ty.content.children());
        self.roots.iter().chain(within)
    }

    /// Checks whether an element may contain children of this name.
    fn is_home(&self, element: &ElementDecl, child: NameId) -> bool {
        let holds = |ty: &ComplexType| ty.content.children().iter().any(|one| one.name == child);
        let others = element.alternatives.iter().map(|other| other.ty);
        others.chain([element.ty]).any(|ty| match ty {
            TypeRef::Complex(id) => self.complex.get(id as usize).is_some_and(holds),
            _ => false,
        })
    }

    /// Returns at most four names of elements that may contain this child, for messages.
    pub(crate) fn parents_of(&self, child: NameId) -> Vec<&str> {
        let mut homes = Vec::new();
        let declared = self.declared();
        for element in declared.filter(|element| self.is_home(element, child)) {
            let name = self.names.text(element.name);
            if !homes.contains(&name) && homes.len() < 4 {
                homes.push(name);
            }
        }
        homes
    }
}

/// The type of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TypeRef {
    /// Any content (`xs:anyType`).
    Any,
    /// Text of a simple type without attributes.
    Simple(u32),
    /// A complex type.
    Complex(u32),
}

/// A type with attributes, children or both.
#[derive(Clone, Debug)]
pub struct ComplexType {
    /// Name of the type in the schema, if it has one.
    pub name: Option<Box<str>>,
    /// Complex type that it extends or restricts.
    pub base: Option<u32>,
    /// Whether elements must have a type derived from this one.
    pub is_abstract: bool,
    /// Whether text may occur between children.
    pub mixed: bool,
    /// Allowed and required attributes.
    pub attributes: Vec<AttributeUse>,
    /// Number of required `attributes`.
    pub required: u16,
    /// Text or children.
    pub content: Content,
    /// Conditions over the whole element (XSD 1.1).
    pub assertions: Vec<Assertion>,
}

/// One attribute of a complex type.
#[derive(Clone, Debug)]
pub struct AttributeUse {
    /// Its name.
    pub name: NameId,
    /// The simple type of its value.
    pub value: u32,
    /// Whether it is required.
    pub required: bool,
    /// The only allowed value, if fixed.
    pub fixed: Option<Box<str>>,
}

/// Content between the tags.
#[derive(Clone, Debug)]
pub enum Content {
    /// Only white space, or text if the type is mixed.
    Empty,
    /// Text of a simple type.
    Text(u32),
    /// Children in an order given by an automaton.
    Children(Model),
    /// Children in any order, each at most once.
    All(AllModel),
}

impl Content {
    /// Returns the declarations of all children.
    pub(crate) fn children(&self) -> &[ElementDecl] {
        match self {
            Content::Empty | Content::Text(_) => &[],
            Content::Children(model) => &model.children,
            Content::All(all) => &all.members,
        }
    }
}

/// A deterministic automaton over child names. State 0 is the start.
#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Declarations of all children of the model, one for each name.
    pub children: Vec<ElementDecl>,
    /// The states.
    pub states: Vec<State>,
    /// The edges of all states. The edges of one state are contiguous.
    pub edges: Vec<Edge>,
}

impl Model {
    /// Returns the edges that leave a state.
    pub(crate) fn edges(&self, state: u16) -> &[Edge] {
        let Some(row) = self.states.get(usize::from(state)) else {
            return &[];
        };
        let first = row.first as usize;
        self.edges
            .get(first..first + usize::from(row.count))
            .unwrap_or(&[])
    }
}

/// One state of a [`Model`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct State {
    /// Index of its first edge.
    pub first: u32,
    /// Number of its edges.
    pub count: u16,
    /// Whether the element may end here.
    pub accepts: bool,
    /// Next state after any other element (`any processContents="skip"`).
    pub wildcard: Option<u16>,
}

/// One step of a [`Model`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Edge {
    /// The child's name.
    pub name: NameId,
    /// Index into [`Model::children`].
    pub child: u16,
    /// The state after it.
    pub to: u16,
}

/// An `all` group with one bit for each member.
#[derive(Clone, Debug, Default)]
pub struct AllModel {
    /// The members, at most 64.
    pub members: Vec<ElementDecl>,
    /// Bits of the required members.
    pub required: u64,
    /// Whether the whole group may be absent.
    pub optional: bool,
}

/// An element declaration in a content model or as a root.
#[derive(Clone, Debug)]
pub struct ElementDecl {
    /// Its name.
    pub name: NameId,
    /// Its type, unless an alternative applies.
    pub ty: TypeRef,
    /// Whether `xsi:nil` is allowed.
    pub nillable: bool,
    /// Types chosen by an attribute's value (XSD 1.1). The first match applies.
    pub alternatives: Vec<Alternative>,
    /// Keys and references with this element as their scope.
    pub constraints: Option<Box<Constraints>>,
}

/// A type chosen by a test on the element's attributes.
#[derive(Clone, Debug)]
pub struct Alternative {
    /// The test, or `None` for the default type.
    pub test: Option<Assertion>,
    /// Type that applies if the test holds.
    pub ty: TypeRef,
}

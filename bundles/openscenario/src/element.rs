//! An element of a scenario, with what its attributes mean where it stands.

use std::borrow::Cow;

use qcbus_document::{Attribute, Node};
use qcbus_schema::ValueType;

use crate::data_type::{Value, parse_boolean, parse_double, parse_integer};
use crate::reading::Reading;
use crate::scenario::Scenario;
use crate::scope::{ContextId, Declaration};
use crate::text::trim;

/// A node together with where it is read: in the document that is checked, or as the entry of a
/// catalog that a reference leads to, with what that reference assigns.
#[derive(Clone, Copy)]
pub struct Element<'m, 'd> {
    pub(crate) scenario: &'m Scenario<'d>,
    pub(crate) node: Node<'d>,
    pub(crate) context: ContextId,
}

impl PartialEq for Element<'_, '_> {
    fn eq(&self, other: &Self) -> bool {
        self.node == other.node && self.context == other.context
    }
}

impl std::fmt::Debug for Element<'_, '_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} in context {}", self.node, self.context)
    }
}

impl<'m, 'd> Element<'m, 'd> {
    /// The node in its document.
    pub fn node(self) -> Node<'d> {
        self.node
    }

    /// The scenario that it is read in.
    pub fn scenario(self) -> &'m Scenario<'d> {
        self.scenario
    }

    /// The local name.
    pub fn name(self) -> &'d str {
        self.node.name()
    }

    /// Whether it has this name.
    pub fn is(self, name: &str) -> bool {
        self.node.is(name)
    }

    /// The name of its type in the schema of its document's version, `AbsoluteSpeed`.
    pub fn class(self) -> Option<&'static str> {
        self.scenario.typing(self.context)?.class(self.node)
    }

    /// The version that the header of its own file names: of the catalog for an entry.
    pub fn stated_version(self) -> Option<crate::Version> {
        let document = self.node.document();
        let stated = qcbus_schema::version_of(&document, self.scenario.kind())?;
        Some((stated.major.try_into().ok()?, stated.minor.try_into().ok()?))
    }

    /// The `CatalogReference` of the document that is checked that leads here; `None` for what is
    /// written in that document itself.
    pub fn reference(self) -> Option<Node<'d>> {
        self.led_to().map(|(reference, _)| reference)
    }

    /// The entry that [`Element::reference`] leads to: this is in it, or in one that it refers to.
    pub fn entry(self) -> Option<Node<'d>> {
        self.led_to().map(|(_, entry)| entry)
    }

    fn led_to(self) -> Option<(Node<'d>, Node<'d>)> {
        let mut context = self.scenario.context(self.context);
        let mut found = None;
        while let Some((reference, outer)) = context.reference {
            found = Some((reference, context.top));
            context = self.scenario.context(outer);
        }
        found
    }

    /// The type of an attribute in the schema of its document's version; `None` where the schema
    /// declares no such attribute, or not even the element.
    pub fn value_type(self, name: &str) -> Option<ValueType> {
        let attribute = self.node.attribute(name)?;
        self.scenario.typing(self.context)?.value(attribute)
    }

    fn at(self, node: Node<'d>) -> Element<'m, 'd> {
        Element { node, ..self }
    }

    /// The element around it. What is around an entry of a catalog is the element with the
    /// reference to it.
    pub fn parent(self) -> Option<Element<'m, 'd>> {
        let context = self.scenario.context(self.context);
        if self.node != context.top {
            return self.node.parent().map(|node| self.at(node));
        }
        let (reference, outer) = context.reference?;
        let node = reference.parent()?;
        Some(Element {
            scenario: self.scenario,
            node,
            context: outer,
        })
    }

    /// The elements around it, the nearest first.
    pub fn ancestors(self) -> impl Iterator<Item = Element<'m, 'd>> {
        std::iter::successors(self.parent(), |element| element.parent())
    }

    /// The nearest element of this name around it.
    pub fn ancestor(self, name: &str) -> Option<Element<'m, 'd>> {
        self.ancestors().find(|element| element.is(name))
    }

    /// The elements directly within it.
    pub fn children(self) -> impl Iterator<Item = Element<'m, 'd>> {
        self.node.children().map(move |node| self.at(node))
    }

    /// The first element of this name directly within it.
    pub fn child(self, name: &str) -> Option<Element<'m, 'd>> {
        self.node.child(name).map(|node| self.at(node))
    }

    /// The element that this path of names leads to, the first of each name.
    pub fn path(self, names: &[&str]) -> Option<Element<'m, 'd>> {
        names
            .iter()
            .try_fold(self, |element, name| element.child(name))
    }

    /// The elements of this name directly within it.
    pub fn children_named<'s>(
        self,
        name: &'s str,
    ) -> impl Iterator<Item = Element<'m, 'd>> + use<'m, 'd, 's> {
        self.node
            .children_named(name)
            .map(move |node| self.at(node))
    }

    /// All elements within it.
    pub fn descendants(self) -> impl Iterator<Item = Element<'m, 'd>> {
        self.node.descendants().map(move |node| self.at(node))
    }

    /// All elements of this name within it; does not follow references to catalogs.
    pub fn descendants_named(
        self,
        name: &str,
    ) -> impl Iterator<Item = Element<'m, 'd>> + use<'m, 'd> {
        self.node
            .descendants_named(name)
            .map(move |node| self.at(node))
    }

    /// An attribute as it is written.
    pub fn written(self, name: &str) -> Option<&'d str> {
        self.node.attr(name)
    }

    /// An attribute.
    pub fn attribute(self, name: &str) -> Option<Attribute<'d>> {
        self.node.attribute(name)
    }

    /// Whether an attribute is there, whatever it says.
    pub fn has(self, name: &str) -> bool {
        self.node.attr(name).is_some()
    }

    /// An attribute as it is to be understood.
    pub fn read(self, name: &str) -> Reading<'d> {
        match self.node.attribute(name) {
            None => Reading::Absent,
            Some(attribute) => self.scenario.read(attribute, self.context),
        }
    }

    /// One of its attributes as it is to be understood.
    pub fn reading(self, attribute: Attribute<'d>) -> Reading<'d> {
        self.scenario.read(attribute, self.context)
    }

    /// An attribute's text, parameters replaced; `None` when it is missing or unknown.
    pub fn text(self, name: &str) -> Option<Cow<'d, str>> {
        match self.read(name) {
            Reading::Literal(text) => Some(Cow::Borrowed(text)),
            Reading::Value(value) => Some(value.text()),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Like [`text`](Element::text), without white space around it: for words and numbers.
    pub fn word(self, name: &str) -> Option<Cow<'d, str>> {
        match self.text(name)? {
            Cow::Borrowed(text) => Some(Cow::Borrowed(trim(text))),
            Cow::Owned(text) => Some(Cow::Owned(trim(&text).to_owned())),
        }
    }

    /// A finite number; `None` when it is missing, unknown or broken.
    pub fn number(self, name: &str) -> Option<f64> {
        self.double(name).filter(|value| value.is_finite())
    }

    /// A double, `INF` and `NaN` among them.
    pub fn double(self, name: &str) -> Option<f64> {
        match self.read(name) {
            Reading::Literal(text) => parse_double(text),
            Reading::Value(value) => value.number(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// An integer.
    pub fn integer(self, name: &str) -> Option<i64> {
        match self.read(name) {
            Reading::Literal(text) => parse_integer(text),
            Reading::Value(value) => value.integer(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// True or false.
    pub fn flag(self, name: &str) -> Option<bool> {
        match self.read(name) {
            Reading::Literal(text) => parse_boolean(text),
            Reading::Value(value) => value.flag(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// The value of a reading; a literal is taken as text.
    pub fn value(self, name: &str) -> Option<Value<'d>> {
        match self.read(name) {
            Reading::Literal(text) => Some(Value::Text(Cow::Borrowed(text))),
            Reading::Value(value) => Some(value),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// The parameter that a name means here.
    pub fn parameter(self, name: &str) -> Option<&'m Declaration<'d>> {
        self.scenario.context(self.context).get(self.node, name)
    }

    /// The names of the parameters that hold here, the innermost first.
    pub fn parameter_names(self) -> impl Iterator<Item = &'d str> {
        self.scenario.context(self.context).names(self.node)
    }

    /// What it declares itself, in its own `ParameterDeclarations`.
    pub fn declarations(self) -> &'m [Declaration<'d>] {
        let frame = self.scenario.context(self.context).frame(self.node);
        frame.map_or(&[], |frame| frame.declarations.as_slice())
    }
}

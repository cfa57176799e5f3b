//! Element of a scenario, with the meaning that its attributes have in its context.

use std::borrow::Cow;

use qcbus_document::{Attribute, Named, Node};
use qcbus_schema::ValueType;

use crate::queries::scenario::{Scenario, key};
use crate::types::data_type::{Value, parse_boolean, parse_double, parse_integer};
use crate::types::declaration::Declaration;
use crate::types::reading::Reading;
use crate::types::scope::ContextId;
use crate::types::text::trim;

/// A node together with the context in which it is read. The context is the checked document, or a
/// catalog entry with the values that its reference assigns.
#[derive(Clone, Copy)]
pub struct Element<'m, 'd> {
    pub(super) scenario: &'m Scenario<'d>,
    pub(super) node: Node<'d>,
    pub(super) context: ContextId,
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
    /// Returns the node in its document.
    pub fn node(self) -> Node<'d> {
        self.node
    }

    /// Returns the scenario that the element is read in.
    pub fn scenario(self) -> &'m Scenario<'d> {
        self.scenario
    }

    /// Returns the local name.
    pub fn name(self) -> &'d str {
        self.node.name()
    }

    /// Checks whether the element has this name.
    pub fn is(self, name: &str) -> bool {
        self.node.is(name)
    }

    /// Returns the name of its type in the schema of its document's version, for example
    /// `AbsoluteSpeed`.
    pub fn class(self) -> Option<&'static str> {
        self.scenario.typing(self.context)?.class(self.node)
    }

    /// Returns the version in the header of its own file. For a catalog entry this is the version
    /// of the catalog.
    pub fn stated_version(self) -> Option<crate::Version> {
        let document = self.node.document();
        let stated = qcbus_schema::version_of(&document, self.scenario.kind())?;
        Some((stated.major.try_into().ok()?, stated.minor.try_into().ok()?))
    }

    /// Returns the `CatalogReference` of the checked document that leads here. Returns `None` for
    /// elements of that document itself.
    pub fn reference(self) -> Option<Node<'d>> {
        self.led_to().map(|(reference, _)| reference)
    }

    /// Returns the entry that [`Element::reference`] leads to. This element is in that entry, or in
    /// one that the entry refers to.
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

    /// Returns the type of an attribute in the schema of its document's version. Returns `None` if
    /// the schema does not declare the attribute or the element.
    pub fn value_type(self, name: &str) -> Option<ValueType> {
        let attribute = self.node.attribute(name)?;
        self.scenario.typing(self.context)?.value(attribute)
    }

    fn at(self, node: Node<'d>) -> Element<'m, 'd> {
        Element { node, ..self }
    }

    /// Returns the parent element. The parent of a catalog entry is the element with the reference
    /// to it.
    pub fn parent(self) -> Option<Element<'m, 'd>> {
        let context = self.scenario.context(self.context);
        if self.node != context.top {
            return self.node.parent().map(|node| self.at(node));
        }
        let (reference, outer) = context.reference?;
        let node = reference.parent()?;
        Some(self.scenario.element_in(outer, node))
    }

    /// Returns the ancestors, the nearest first.
    pub fn ancestors(self) -> impl Iterator<Item = Element<'m, 'd>> {
        std::iter::successors(self.parent(), |element| element.parent())
    }

    /// Returns the nearest ancestor of this name.
    pub fn ancestor(self, name: &str) -> Option<Element<'m, 'd>> {
        self.ancestors().find(|element| element.is(name))
    }

    /// Returns the child elements.
    pub fn children(self) -> impl Iterator<Item = Element<'m, 'd>> {
        self.node.children().map(move |node| self.at(node))
    }

    /// Returns the first child of this name.
    pub fn child(self, name: &str) -> Option<Element<'m, 'd>> {
        self.node.child(name).map(|node| self.at(node))
    }

    /// Returns the element at this path of names. On each level the first child of the name is
    /// taken.
    pub fn path(self, names: &[&str]) -> Option<Element<'m, 'd>> {
        names
            .iter()
            .try_fold(self, |element, name| element.child(name))
    }

    /// Returns the children of this name.
    pub fn children_named<'s>(
        self,
        name: &'s str,
    ) -> impl Iterator<Item = Element<'m, 'd>> + use<'m, 'd, 's> {
        self.node
            .children_named(name)
            .map(move |node| self.at(node))
    }

    /// Returns all descendants.
    pub fn descendants(self) -> impl Iterator<Item = Element<'m, 'd>> {
        self.node.descendants().map(move |node| self.at(node))
    }

    /// Returns all descendants of this name. Does not follow references to catalogs.
    pub fn descendants_named(
        self,
        name: &str,
    ) -> impl Iterator<Item = Element<'m, 'd>> + use<'m, 'd> {
        self.node
            .descendants_named(name)
            .map(move |node| self.at(node))
    }

    /// Returns an attribute as it is written.
    pub fn written(self, name: &str) -> Option<&'d str> {
        self.node.attr(name)
    }

    /// Returns an attribute.
    pub fn attribute(self, name: &str) -> Option<Attribute<'d>> {
        self.node.attribute(name)
    }

    /// Checks whether an attribute exists, with any value.
    pub fn has(self, name: &str) -> bool {
        self.node.attr(name).is_some()
    }

    /// Returns an attribute as it is understood.
    pub fn read(self, name: &str) -> Reading<'d> {
        match self.node.attribute(name) {
            None => Reading::Absent,
            Some(attribute) => self.scenario.read(attribute, self.context),
        }
    }

    /// Returns one of its attributes as it is understood.
    pub fn reading(self, attribute: Attribute<'d>) -> Reading<'d> {
        self.scenario.read(attribute, self.context)
    }

    /// Returns an attribute's text with parameters replaced. Returns `None` if it is missing or
    /// unknown.
    pub fn text(self, name: &str) -> Option<Cow<'d, str>> {
        match self.read(name) {
            Reading::Literal(text) => Some(Cow::Borrowed(text)),
            Reading::Value(value) => Some(value.text()),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Like [`text`](Element::text), but without white space around it. For words and numbers.
    pub fn word(self, name: &str) -> Option<Cow<'d, str>> {
        match self.text(name)? {
            Cow::Borrowed(text) => Some(Cow::Borrowed(trim(text))),
            Cow::Owned(text) => Some(Cow::Owned(trim(&text).to_owned())),
        }
    }

    /// Returns a finite number. Returns `None` if it is missing, unknown or broken.
    pub fn number(self, name: &str) -> Option<f64> {
        self.double(name).filter(|value| value.is_finite())
    }

    /// Returns a double, which may be `INF` or `NaN`.
    pub fn double(self, name: &str) -> Option<f64> {
        match self.read(name) {
            Reading::Literal(text) => parse_double(text),
            Reading::Value(value) => value.number(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Returns an integer.
    pub fn integer(self, name: &str) -> Option<i64> {
        match self.read(name) {
            Reading::Literal(text) => parse_integer(text),
            Reading::Value(value) => value.integer(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Returns true or false.
    pub fn flag(self, name: &str) -> Option<bool> {
        match self.read(name) {
            Reading::Literal(text) => parse_boolean(text),
            Reading::Value(value) => value.flag(),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Returns the value of a reading. A literal is taken as text.
    pub fn value(self, name: &str) -> Option<Value<'d>> {
        match self.read(name) {
            Reading::Literal(text) => Some(Value::Text(Cow::Borrowed(text))),
            Reading::Value(value) => Some(value),
            Reading::Absent | Reading::Unknown => None,
        }
    }

    /// Returns the parameter that a name means here.
    pub fn parameter(self, name: &str) -> Option<&'m Declaration<'d>> {
        self.scenario.context(self.context).get(self.node, name)
    }

    /// Returns the names of the parameters that are in scope here, the innermost first.
    pub fn parameter_names(self) -> impl Iterator<Item = &'d str> {
        self.scenario.context(self.context).names(self.node)
    }

    /// Returns the first of its own declarations with this name.
    pub fn declaration(self, name: &str) -> Option<&'m Declaration<'d>> {
        let frame = self.scenario.context(self.context).frame(self.node);
        frame?.get(name)
    }

    /// Returns the declarations in its own `ParameterDeclarations`.
    pub fn declarations(self) -> &'m [Declaration<'d>] {
        let frame = self.scenario.context(self.context).frame(self.node);
        frame.map_or(&[], |frame| frame.declarations.as_slice())
    }
}

impl<'d> Scenario<'d> {
    /// Returns the root element.
    pub fn root(&self) -> Element<'_, 'd> {
        self.element(self.contexts[0].top)
    }

    /// Returns the elements of a name in the document itself, in document order.
    pub fn elements(&self, name: &str) -> impl Iterator<Item = Element<'_, 'd>> {
        let nodes = self.document.elements(name);
        nodes.map(|node| self.element(node))
    }

    /// Returns an element of the document itself.
    pub fn element(&self, node: Node<'d>) -> Element<'_, 'd> {
        self.element_in(0, node)
    }

    /// Returns an element that is read in a context.
    pub(super) fn element_in(&self, context: ContextId, node: Node<'d>) -> Element<'_, 'd> {
        Element {
            scenario: self,
            node,
            context,
        }
    }

    /// Returns the elements of a name in the document and in the catalog entries that it refers to.
    /// An entry occurs once per reference.
    pub fn elements_everywhere(&self, name: &str) -> impl Iterator<Item = Element<'_, 'd>> {
        // The list is cached per document, because thousands of references may lead to entries of
        // the same few catalogs.
        let mut known: Vec<(usize, Named<'d>)> = Vec::new();
        self.tops().flat_map(move |top| {
            let document = top.node.document();
            let key = key(document);
            let named = match known.iter().find(|(other, _)| *other == key) {
                Some((_, named)) => *named,
                None => {
                    let named = document.named(name);
                    known.push((key, named));
                    named
                }
            };
            let itself = top.is(name).then_some(top);
            let within = named.within(top.node);
            let within = within.map(move |node| Element { node, ..top });
            itself.into_iter().chain(within)
        })
    }

    /// Returns the root element, and each catalog entry once per reference to it.
    pub fn tops(&self) -> impl Iterator<Item = Element<'_, 'd>> {
        let contexts = (0..).zip(&self.contexts);
        contexts.map(|(context, one)| self.element_in(context, one.top))
    }
}

//! Complex types.

use std::collections::HashMap;

use qcbus_document::Node;

use super::Compiler;
use super::components::{Kind, Resolved};
use super::content;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use super::particle::Draft;
use crate::assertion::Assertion;
use crate::model::{AttributeUse, ComplexType, Content, TypeRef};

/// Numbered types and types that still need a definition.
#[derive(Default)]
pub(super) struct Known<'d> {
    nodes: HashMap<Node<'d>, u32>,
    waiting: Vec<(Node<'d>, u32)>,
}

/// A type with all inherited parts.
#[derive(Default)]
struct Body {
    draft: Draft,
    attributes: Vec<AttributeUse>,
    assertions: Vec<Assertion>,
    mixed: bool,
    text: Option<u32>,
    base: Option<u32>,
}

impl<'d> Compiler<'d, '_> {
    /// Returns the number of a complex type. The type is defined later, so types may be recursive.
    pub(super) fn complex_of(&mut self, node: Node<'d>) -> Result<u32, CompileError> {
        if let Some(&id) = self.complex.nodes.get(&node) {
            return Ok(id);
        }
        let id = u32::try_from(self.schema.complex.len()).unwrap_or(u32::MAX);
        self.schema.complex.push(placeholder(node));
        self.complex.nodes.insert(node, id);
        self.complex.waiting.push((node, id));
        Ok(id)
    }

    /// Defines all types that were numbered.
    pub(super) fn define_waiting(&mut self) -> Result<(), CompileError> {
        let mut next = 0;
        while let Some(&(node, id)) = self.complex.waiting.get(next) {
            self.define_complex(node, id)?;
            next += 1;
        }
        Ok(())
    }

    fn define_complex(&mut self, node: Node<'d>, id: u32) -> Result<(), CompileError> {
        let mut body = Body::default();
        self.collect(node, &mut body)?;
        self.check_fixed(node, &body.attributes)?;
        let content = match body.text {
            Some(text) => Content::Text(text),
            None => content::finish(node, body.draft)?,
        };
        let required = body
            .attributes
            .iter()
            .filter(|attribute| attribute.required)
            .count();
        if body.attributes.len() > 512 {
            return refuse(node, Problem::TooLarge("attributes", 512));
        }
        let ty = &mut self.schema.complex[id as usize];
        ty.required = u16::try_from(required).unwrap_or(u16::MAX);
        ty.base = body.base;
        ty.mixed = body.mixed;
        ty.attributes = body.attributes;
        ty.content = content;
        ty.assertions = body.assertions;
        Ok(())
    }

    /// Adds the content of a type. Base types come first.
    fn collect(&mut self, node: Node<'d>, body: &mut Body) -> Result<(), CompileError> {
        only_attributes(node, &["name", "abstract", "mixed", "final"])?;
        let mut members = parts(node);
        let first = members.next();
        match first.map(|first| first.name()) {
            Some(derivation @ ("simpleContent" | "complexContent")) => {
                if members.next().is_some() {
                    return refuse(node, Problem::Unsupported);
                }
                let (Some(wrapper), simple) = (first, derivation == "simpleContent") else {
                    return Ok(());
                };
                self.derived(wrapper, simple, body)?;
            }
            _ => self.own(parts(node), body)?,
        }
        if let Some(mixed) = flag(node, "mixed")? {
            body.mixed |= mixed;
        }
        Ok(())
    }

    fn derived(
        &mut self,
        wrapper: Node<'d>,
        simple: bool,
        body: &mut Body,
    ) -> Result<(), CompileError> {
        only_attributes(wrapper, if simple { &[] } else { &["mixed"] })?;
        let mut steps = parts(wrapper);
        let (Some(step), None) = (steps.next(), steps.next()) else {
            return refuse(wrapper, Problem::Unsupported);
        };
        only_attributes(step, &["base"])?;
        let base = required(step, "base")?;
        match (step.name(), simple) {
            ("extension", _) => self.deeper(step, |this| this.inherit(step, base, simple, body))?,
            ("restriction", false) => {
                self.deeper(step, |this| this.inherit(step, base, simple, body))?;
                // A restriction repeats its content. It inherits only attributes.
                body.draft = Draft::default();
                body.mixed = false;
            }
            _ => return refuse(step, Problem::Unsupported),
        }
        body.mixed |= flag(wrapper, "mixed")?.unwrap_or(false);
        self.own(parts(step), body)
    }

    fn inherit(
        &mut self,
        step: Node<'d>,
        base: &'d str,
        simple: bool,
        body: &mut Body,
    ) -> Result<(), CompileError> {
        if let Resolved::Own(local) = self.components.resolve(step, base)?
            && let Some(found) = self.components.find(Kind::Complex, local)
        {
            self.collect(found, body)?;
            body.base = Some(self.complex_of(found)?);
            return if body.text.is_some() == simple {
                Ok(())
            } else {
                refuse(
                    step,
                    Problem::Invalid(
                        "the base type must have the same kind of content (simple or complex)",
                    ),
                )
            };
        }
        match self.type_ref(step, base)? {
            TypeRef::Simple(id) if simple => body.text = Some(id),
            TypeRef::Any if !simple => {}
            _ => {
                return refuse(step, Problem::Value("base", base.to_owned()));
            }
        }
        Ok(())
    }

    fn own(
        &mut self,
        members: impl Iterator<Item = Node<'d>>,
        body: &mut Body,
    ) -> Result<(), CompileError> {
        let mut content_seen = false;
        for member in members {
            match member.name() {
                "sequence" | "choice" | "all" | "group" if !content_seen && body.text.is_none() => {
                    content_seen = true;
                    self.add_content(member, &mut body.draft)?;
                }
                "attribute" | "attributeGroup" => {
                    self.add_attribute(member, &mut body.attributes)?;
                }
                "assert" => {
                    self.needs_1_1();
                    only_attributes(member, &["test"])?;
                    let test =
                        Assertion::from_xpath(required(member, "test")?, &mut self.schema.names);
                    body.assertions
                        .push(test.map_err(|error| CompileError::at(member, error))?);
                }
                _ => return refuse(member, Problem::Unsupported),
            }
        }
        Ok(())
    }
}

fn placeholder(node: Node<'_>) -> ComplexType {
    ComplexType {
        name: node.attr("name").map(Into::into),
        base: None,
        is_abstract: matches!(node.attr("abstract").map(str::trim), Some("true" | "1")),
        mixed: false,
        attributes: Vec::new(),
        required: 0,
        content: Content::Empty,
        assertions: Vec::new(),
    }
}

/// Returns a boolean attribute of a schema construct.
pub(super) fn flag(node: Node<'_>, name: &'static str) -> Result<Option<bool>, CompileError> {
    match node.attr(name).map(str::trim) {
        None => Ok(None),
        Some("true" | "1") => Ok(Some(true)),
        Some("false" | "0") => Ok(Some(false)),
        Some(other) => refuse(node, Problem::Value(name, other.to_owned())),
    }
}

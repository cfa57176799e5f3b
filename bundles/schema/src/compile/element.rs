//! Element declarations.

use qcbus_document::Node;

use super::Compiler;
use super::complex::flag;
use super::components::Kind;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use crate::assertion::Assertion;
use crate::model::{Alternative, ElementDecl, TypeRef};

const GLOBAL: &[&str] = &["name", "type", "nillable"];
const LOCAL: &[&str] = &["name", "type", "nillable", "minOccurs", "maxOccurs", "form"];

impl<'d> Compiler<'d, '_> {
    /// Reads an element in a content model and resolves references.
    pub(super) fn local_element(&mut self, node: Node<'d>) -> Result<ElementDecl, CompileError> {
        let Some(reference) = node.attr("ref") else {
            only_attributes(node, LOCAL)?;
            return self.declaration(node);
        };
        only_attributes(node, &["ref", "minOccurs", "maxOccurs"])?;
        let global = self
            .components
            .get(node, Kind::Element, "element", reference)?;
        self.element(global)
    }

    /// Reads a global element.
    pub(super) fn element(&mut self, node: Node<'d>) -> Result<ElementDecl, CompileError> {
        only_attributes(node, GLOBAL)?;
        self.declaration(node)
    }

    fn declaration(&mut self, node: Node<'d>) -> Result<ElementDecl, CompileError> {
        let name = self.name(node, required(node, "name")?)?;
        let mut ty = node
            .attr("type")
            .map(|name| self.type_ref(node, name))
            .transpose()?;
        let mut alternatives = Vec::new();
        let mut constraints = Vec::new();
        for part in parts(node) {
            match part.name() {
                "simpleType" if ty.is_none() => ty = Some(TypeRef::Simple(self.simple_of(part)?)),
                "complexType" if ty.is_none() => {
                    ty = Some(TypeRef::Complex(self.complex_of(part)?));
                }
                "alternative" => alternatives.push(self.alternative(part)?),
                "key" | "unique" | "keyref" => constraints.push(part),
                _ => return refuse(part, Problem::Unsupported),
            }
        }
        let constraints = self.constraints(node, &constraints)?;
        let nillable = flag(node, "nillable")?.unwrap_or(false);
        Ok(ElementDecl {
            name,
            ty: ty.unwrap_or(TypeRef::Any),
            nillable,
            alternatives,
            constraints,
        })
    }

    fn alternative(&mut self, node: Node<'d>) -> Result<Alternative, CompileError> {
        self.needs_1_1();
        only_attributes(node, &["test", "type"])?;
        let test = node
            .attr("test")
            .map(|text| Assertion::from_xpath(text, &mut self.schema.names));
        let test = test
            .transpose()
            .map_err(|error| CompileError::at(node, error))?;
        let ty = self.type_ref(node, required(node, "type")?)?;
        Ok(Alternative { test, ty })
    }
}

//! Attributes and attribute groups.

use qcbus_document::Node;

use super::Compiler;
use super::components::Kind;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use crate::model::AttributeUse;
use crate::simple::{Builtin, Variety};

impl<'d> Compiler<'d, '_> {
    /// Adds the declarations of an `xs:attribute` or `xs:attributeGroup`. A later declaration of a
    /// name replaces an inherited one.
    pub(super) fn add_attribute(
        &mut self,
        node: Node<'d>,
        all: &mut Vec<AttributeUse>,
    ) -> Result<(), CompileError> {
        if node.is("attributeGroup") {
            only_attributes(node, &["ref"])?;
            let group = self.components.get(
                node,
                Kind::AttributeGroup,
                "attribute group",
                required(node, "ref")?,
            )?;
            return self.deeper(node, |this| {
                only_attributes(group, &["name"])?;
                parts(group).try_for_each(|part| this.add_attribute(part, all))
            });
        }
        if !node.is("attribute") {
            return refuse(node, Problem::Unsupported);
        }
        let declared = self.attribute(node)?;
        all.retain(|have| have.name != declared.0.name);
        if !declared.1 {
            all.push(declared.0);
        }
        Ok(())
    }

    /// Reads an attribute, and whether it is prohibited.
    fn attribute(&mut self, node: Node<'d>) -> Result<(AttributeUse, bool), CompileError> {
        only_attributes(
            node,
            &["name", "ref", "type", "use", "fixed", "default", "form"],
        )?;
        if node.attr("form").is_some_and(|form| form != "unqualified") {
            return refuse(node, Problem::Attribute("form".into()));
        }
        let declaration = match node.attr("ref") {
            Some(name) => self
                .components
                .get(node, Kind::Attribute, "attribute", name)?,
            None => node,
        };
        let (needed, prohibited) = match node.attr("use") {
            None | Some("optional") => (false, false),
            Some("required") => (true, false),
            Some("prohibited") => (false, true),
            Some(other) => {
                return refuse(node, Problem::Value("use", other.to_owned()));
            }
        };
        let name = self.name(declaration, required(declaration, "name")?)?;
        let value = self.attribute_type(declaration)?;
        let fixed = node
            .attr("fixed")
            .or(declaration.attr("fixed"))
            .map(Into::into);
        Ok((
            AttributeUse {
                name,
                value,
                required: needed,
                fixed,
            },
            prohibited,
        ))
    }

    fn attribute_type(&mut self, node: Node<'d>) -> Result<u32, CompileError> {
        let inner = parts(node).next();
        match (node.attr("type"), inner) {
            (Some(name), None) => self.simple_named(node, name),
            (None, Some(inner)) if inner.is("simpleType") => self.simple_of(inner),
            (None, None) => self.builtin(node, Builtin::AnySimple.name()),
            _ => refuse(
                node,
                Problem::Invalid("an attribute must have exactly one type"),
            ),
        }
    }

    /// Checks that fixed values are values of their type.
    pub(super) fn check_fixed(
        &self,
        node: Node<'d>,
        all: &[AttributeUse],
    ) -> Result<(), CompileError> {
        for attribute in all {
            let Some(fixed) = &attribute.fixed else {
                continue;
            };
            let ty = &self.schema.simple[attribute.value as usize];
            let comparable = matches!(ty.variety, Variety::Atomic(_));
            if !comparable || !ty.accepts(fixed, &self.schema) {
                return refuse(node, Problem::Value("fixed", fixed.to_string()));
            }
        }
        Ok(())
    }
}

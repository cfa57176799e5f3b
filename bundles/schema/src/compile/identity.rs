//! Identity constraints: `key`, `unique` and `keyref`.

use qcbus_document::Node;

use super::Compiler;
use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};
use crate::constraint::{Constraint, ConstraintKind, Constraints, Step};

impl<'d> Compiler<'d, '_> {
    /// Reads the constraints declared on one element.
    pub(super) fn constraints(
        &mut self,
        element: Node<'d>,
        nodes: &[Node<'d>],
    ) -> Result<Option<Box<Constraints>>, CompileError> {
        let mut list = Vec::new();
        for &node in nodes {
            list.push(self.constraint(node, nodes)?);
        }
        if list.is_empty() {
            return Ok(None);
        }
        let merged = Constraints::new(list);
        let too_large = || {
            CompileError::at(
                element,
                Problem::TooLarge("selector steps", usize::from(u16::MAX)),
            )
        };
        merged.map(Box::new).map(Some).ok_or_else(too_large)
    }

    fn constraint(
        &mut self,
        node: Node<'d>,
        siblings: &[Node<'d>],
    ) -> Result<Constraint, CompileError> {
        let kind = match node.name() {
            "key" => ConstraintKind::Key,
            "unique" => ConstraintKind::Unique,
            _ => ConstraintKind::Reference(refers_to(node, siblings)?),
        };
        let known: &[&str] = if node.is("keyref") {
            &["name", "refer"]
        } else {
            &["name"]
        };
        only_attributes(node, known)?;
        let mut members = parts(node);
        let (Some(selector), Some(field), None) = (members.next(), members.next(), members.next())
        else {
            return refuse(
                node,
                Problem::Invalid("only one selector and one field are supported"),
            );
        };
        let paths = self.selector(selector)?;
        let field = self.field(field)?;
        Ok(Constraint {
            name: required(node, "name")?.into(),
            kind,
            paths,
            field,
        })
    }

    fn selector(&mut self, node: Node<'d>) -> Result<Vec<Vec<Step>>, CompileError> {
        only_attributes(node, &["xpath"])?;
        let text = required(node, "xpath")?;
        let mut paths = Vec::new();
        for path in text.split('|') {
            let mut steps = Vec::new();
            for (index, step) in path.trim().split('/').enumerate() {
                match step.trim() {
                    "." if index == 0 => {}
                    "*" => steps.push(Step::Any),
                    name if is_step(name) => steps.push(Step::Child(self.name(node, local(name))?)),
                    _ => {
                        return refuse(node, Problem::Value("xpath", text.to_owned()));
                    }
                }
            }
            paths.push(steps);
        }
        Ok(paths)
    }

    fn field(&mut self, node: Node<'d>) -> Result<crate::names::NameId, CompileError> {
        only_attributes(node, &["xpath"])?;
        let text = required(node, "xpath")?.trim();
        match text.strip_prefix('@') {
            Some(name) if node.is("field") && is_step(name) => self.name(node, name),
            _ => refuse(node, Problem::Value("xpath", text.to_owned())),
        }
    }
}

fn refers_to(node: Node<'_>, siblings: &[Node<'_>]) -> Result<u16, CompileError> {
    let wanted = local(required(node, "refer")?);
    let position = siblings
        .iter()
        .position(|other| !other.is("keyref") && other.attr("name") == Some(wanted));
    position
        .and_then(|index| u16::try_from(index).ok())
        .ok_or_else(|| {
            CompileError::at(
                node,
                Problem::Missing("key (on the same element)", wanted.to_owned()),
            )
        })
}

fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap_or(name)
}

fn is_step(name: &str) -> bool {
    let mut chars = name.chars();
    chars.next().is_some_and(|c| c.is_alphabetic() || c == '_')
        && chars.all(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '.' | ':'))
}

//! Types of elements.

use std::collections::HashMap;

use qcbus_document::Node;

use super::names::{AttributeName, XSI};
use super::{Walk, wording};
use crate::assertion::Scope;
use crate::model::{ComplexType, ElementDecl, TypeRef};
use crate::violation::Code;
use crate::work::steps;

/// The type of an element.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind<'s> {
    Simple(u32),
    Complex(u32, &'s ComplexType),
}

impl<'a, 's> Walk<'a, 's> {
    /// Returns the element's type, or `None` if its content needs no further check.
    pub(super) fn type_of(
        &mut self,
        node: Node<'a>,
        declared: &'s ElementDecl,
    ) -> Option<Kind<'s>> {
        let mut ty = declared.ty;
        let mut chosen = declared.alternatives.is_empty();
        for alternative in &declared.alternatives {
            if alternative
                .test
                .as_ref()
                .is_none_or(|test| test.holds(node, &self.scope()))
            {
                ty = alternative.ty;
                chosen = true;
                break;
            }
        }
        if let Some(written) = self.xsi(node, "type") {
            ty = self.written_type(node, written, ty)?;
        }
        match ty {
            TypeRef::Any => None,
            TypeRef::Simple(id) => Some(Kind::Simple(id)),
            TypeRef::Complex(id) => {
                let complex = self.schema.complex.get(id as usize)?;
                if complex.is_abstract {
                    let key = (id as usize, 0);
                    let defined = !chosen;
                    self.reporter.add(Code::UnknownType, key, node, || {
                        wording::no_type(node, declared, defined, self.schema)
                    });
                    return None;
                }
                Some(Kind::Complex(id, complex))
            }
        }
    }

    /// Returns the type that `xsi:type` names, if it is the declared type or derived from it.
    fn written_type(
        &mut self,
        node: Node<'a>,
        written: &'a str,
        declared: TypeRef,
    ) -> Option<TypeRef> {
        let local = written.trim().rsplit(':').next().unwrap_or("");
        let found = self
            .schema
            .complex
            .iter()
            .position(|ty| ty.name.as_deref() == Some(local));
        let mut at = found.and_then(|index| u32::try_from(index).ok());
        let chosen = at;
        // Compiled tables have no cycle of base types, but a table file could contain one.
        for _ in 0..=self.schema.complex.len().min(64) {
            let Some(id) = at else { break };
            if declared == TypeRef::Complex(id) || declared == TypeRef::Any {
                return chosen.map(TypeRef::Complex);
            }
            at = self.schema.complex.get(id as usize).and_then(|ty| ty.base);
        }
        if let TypeRef::Simple(_) = declared {
            return Some(declared);
        }
        self.reporter.add(Code::UnknownType, (0, 1), node, || {
            wording::bad_xsi_type(node, written)
        });
        None
    }

    /// Returns the value of an `xsi:` attribute, with any prefix for its namespace.
    pub(super) fn xsi(&mut self, node: Node<'a>, local: &str) -> Option<&'a str> {
        if !self.names.prefixed {
            return None;
        }
        let (names, bindings) = (&self.names, &mut self.bindings);
        node.attributes().find_map(|one| {
            steps(1);
            if names.attribute(one) != AttributeName::Prefixed {
                return None;
            }
            let (prefix, name) = one.name().split_once(':')?;
            (name == local && bindings.is_xsi(node, prefix)).then(|| one.value())
        })
    }

    pub(super) fn is_nil(&mut self, node: Node<'a>, declared: &ElementDecl) -> bool {
        declared.nillable
            && self
                .xsi(node, "nil")
                .is_some_and(|value| matches!(value.trim(), "true" | "1"))
    }

    pub(super) fn scope(&self) -> Scope<'a, '_> {
        Scope {
            document: self.document,
            names: self.names.ids(),
        }
    }

    /// Checks the assertions of a type.
    pub(super) fn conditions(&mut self, node: Node<'a>, kind: Kind<'s>) {
        let Kind::Complex(id, ty) = kind else { return };
        for (index, assertion) in ty.assertions.iter().enumerate() {
            if !assertion.holds(node, &self.scope()) {
                let key = (id as usize, u32::try_from(index).unwrap_or(u32::MAX));
                self.reporter.add(Code::ConditionFailed, key, node, || {
                    wording::condition_failed(node, assertion, self.schema)
                });
            }
        }
    }
}

/// Prefixes bound by open elements, each with the end of its scope.
#[derive(Debug, Default)]
pub(super) struct Bindings<'a> {
    by_prefix: HashMap<&'a str, Vec<(u32, bool)>>,
}

impl<'a> Bindings<'a> {
    /// Checks whether `prefix` is bound to the namespace of schema instances at `node`.
    pub(super) fn is_xsi(&mut self, node: Node<'_>, prefix: &str) -> bool {
        let Some(bound) = self.by_prefix.get_mut(prefix) else {
            return prefix == "xsi";
        };
        steps(1);
        while bound.last().is_some_and(|(end, _)| *end <= node.index()) {
            bound.pop();
        }
        bound.last().map_or(prefix == "xsi", |(_, is_xsi)| *is_xsi)
    }
}

impl<'a> Walk<'a, '_> {
    /// Stores the prefixes that an element binds.
    pub(super) fn bind(&mut self, node: Node<'a>) {
        if !self.names.prefixed {
            return;
        }
        for attribute in node.attributes() {
            steps(1);
            if let Some(prefix) = attribute.name().strip_prefix("xmlns:") {
                let bound = self.bindings.by_prefix.entry(prefix).or_default();
                while bound.last().is_some_and(|(end, _)| *end <= node.index()) {
                    bound.pop();
                }
                bound.push((node.subtree_end(), attribute.value() == XSI));
            }
        }
    }
}

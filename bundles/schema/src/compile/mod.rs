//! Compiler from XSD documents to tables.
//!
//! The XSD files are read through document images like all other files. The compiler supports the
//! subset of XML Schema that the schemas of OpenDRIVE and OpenSCENARIO use. Each construct lists
//! its supported attributes and children. All others give an error with the construct, the file and
//! the line. The compiler never skips a construct silently.

mod attributes;
mod complex;
mod components;
mod content;
mod dfa;
mod element;
mod error;
mod identity;
mod particle;
mod simple;

use qcbus_document::{Document, Node};

pub use error::{CompileError, Problem};

use crate::edition::Edition;
use crate::model::{Schema, TypeRef};
use components::{Components, Kind};
use error::refuse;

/// Compiles a set of XSD documents that belong together (a schema and its includes).
///
/// The result does not depend on the order of `documents`.
///
/// # Errors
/// If a document is not a schema, refers to a missing component, or uses an unsupported construct.
pub fn compile(title: &str, documents: &[Document<'_>]) -> Result<Schema, CompileError> {
    let components = Components::collect(documents)?;
    let mut compiler = Compiler::new(title, &components);
    compiler.schema.namespace = components.namespace.map(Into::into);
    for node in components.in_order() {
        match components::kind(node) {
            Some(Kind::Simple) => {
                compiler.simple_of(node)?;
            }
            Some(Kind::Complex) => {
                compiler.complex_of(node)?;
            }
            Some(Kind::Element) => {
                let root = compiler.element(node)?;
                compiler.schema.roots.push(root);
            }
            _ => {}
        }
    }
    compiler.finish()
}

/// State of a compilation.
struct Compiler<'d, 'c> {
    components: &'c Components<'d>,
    schema: Schema,
    simple: simple::Known<'d>,
    complex: complex::Known<'d>,
    /// Nesting depth of the current construct, including anonymous types and group references.
    depth: usize,
}

/// Maximum nesting of anonymous types, base types and group references. Authors stay below ten.
const MAX_DEPTH: usize = 64;

impl<'d, 'c> Compiler<'d, 'c> {
    fn new(title: &str, components: &'c Components<'d>) -> Self {
        Self {
            components,
            schema: Schema::new(title),
            simple: simple::Known::default(),
            complex: complex::Known::default(),
            depth: 0,
        }
    }

    fn finish(mut self) -> Result<Schema, CompileError> {
        self.define_waiting()?;
        if self.schema.roots.is_empty() {
            return Err(CompileError::somewhere_in(
                self.components.path,
                Problem::NoRoot,
            ));
        }
        if let Some(id) = self.schema.endless_condition() {
            let name = self
                .schema
                .complex
                .get(id as usize)
                .and_then(|ty| ty.name.clone());
            let name = name.unwrap_or_default();
            let problem = Problem::EndlessCondition(name.to_string());
            return Err(match self.components.find(Kind::Complex, &name) {
                Some(node) => CompileError::at(node, problem),
                None => CompileError::somewhere_in(self.components.path, problem),
            });
        }
        Ok(self.schema)
    }

    /// Runs `inner` one level deeper.
    fn deeper<T>(
        &mut self,
        node: Node<'d>,
        inner: impl FnOnce(&mut Self) -> Result<T, CompileError>,
    ) -> Result<T, CompileError> {
        if self.depth >= MAX_DEPTH {
            return refuse(node, Problem::TooDeep);
        }
        self.depth += 1;
        let result = inner(self);
        self.depth -= 1;
        result
    }

    fn needs_1_1(&mut self) {
        self.schema.edition = Edition::V1_1;
    }

    fn name(&mut self, node: Node<'d>, name: &str) -> Result<crate::names::NameId, CompileError> {
        self.schema
            .names
            .intern(name)
            .ok_or_else(|| CompileError::at(node, Problem::TooLarge("names", 65_534)))
    }

    /// Returns the type that a `type`, `base` or `itemType` attribute refers to.
    fn type_ref(&mut self, node: Node<'d>, name: &str) -> Result<TypeRef, CompileError> {
        match self.components.resolve(node, name)? {
            components::Resolved::BuiltIn("anyType") => Ok(TypeRef::Any),
            components::Resolved::BuiltIn(local) => self.builtin(node, local).map(TypeRef::Simple),
            components::Resolved::Own(local) => {
                if let Some(found) = self.components.find(Kind::Simple, local) {
                    return self.simple_of(found).map(TypeRef::Simple);
                }
                let Some(found) = self.components.find(Kind::Complex, local) else {
                    return refuse(node, Problem::Missing("type", local.to_owned()));
                };
                self.complex_of(found).map(TypeRef::Complex)
            }
        }
    }
}

//! The global components of a set of schema documents.

use std::collections::HashMap;

use qcbus_document::{Document, Node};

use super::error::{CompileError, Problem, only_attributes, parts, refuse, required};

const XSD: &str = "http://www.w3.org/2001/XMLSchema";

/// Kinds of global components. Simple and complex types share one symbol space.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    Simple,
    Complex,
    Element,
    Group,
    AttributeGroup,
    Attribute,
}

pub(super) fn kind(node: Node<'_>) -> Option<Kind> {
    Some(match node.name() {
        "simpleType" => Kind::Simple,
        "complexType" => Kind::Complex,
        "element" => Kind::Element,
        "group" => Kind::Group,
        "attributeGroup" => Kind::AttributeGroup,
        "attribute" => Kind::Attribute,
        _ => return None,
    })
}

/// Target of a qualified name.
pub(super) enum Resolved<'d> {
    BuiltIn(&'d str),
    Own(&'d str),
}

/// All global components by kind and name.
pub(super) struct Components<'d> {
    found: HashMap<(Kind, &'d str), Node<'d>>,
    order: Vec<Node<'d>>,
    pub(super) namespace: Option<&'d str>,
    /// Path of the first file.
    pub(super) path: &'d str,
}

impl<'d> Components<'d> {
    pub(super) fn collect(documents: &[Document<'d>]) -> Result<Self, CompileError> {
        let mut sorted: Vec<&Document<'d>> = documents.iter().collect();
        sorted.sort_by_key(|document| file_name(document.path()));
        let names: Vec<&str> = sorted
            .iter()
            .map(|document| file_name(document.path()))
            .collect();
        let mut all = Self {
            found: HashMap::new(),
            order: Vec::new(),
            namespace: None,
            path: sorted.first().map_or("", |document| document.path()),
        };
        for document in sorted {
            let root = schema_root(document)?;
            all.add_document(root, &names)?;
        }
        Ok(all)
    }

    fn add_document(&mut self, root: Node<'d>, names: &[&str]) -> Result<(), CompileError> {
        only_attributes(
            root,
            &[
                "targetNamespace",
                "elementFormDefault",
                "attributeFormDefault",
                "version",
            ],
        )?;
        if let Some(namespace) = root.attr("targetNamespace") {
            if self.namespace.is_some_and(|have| have != namespace) {
                return refuse(
                    root,
                    Problem::Value("targetNamespace", namespace.to_owned()),
                );
            }
            self.namespace = Some(namespace);
        }
        for child in parts(root) {
            if child.is("include") {
                include(child, names)?;
            } else {
                self.add(child)?;
            }
        }
        Ok(())
    }

    fn add(&mut self, node: Node<'d>) -> Result<(), CompileError> {
        let kind = kind(node).ok_or_else(|| CompileError::at(node, Problem::Unsupported))?;
        let name = required(node, "name")?;
        // Simple and complex types share one symbol space.
        let other = match kind {
            Kind::Simple => self.found.contains_key(&(Kind::Complex, name)),
            Kind::Complex => self.found.contains_key(&(Kind::Simple, name)),
            _ => false,
        };
        if other || self.found.insert((kind, name), node).is_some() {
            return refuse(node, Problem::Twice(name.to_owned()));
        }
        self.order.push(node);
        Ok(())
    }

    pub(super) fn in_order(&self) -> impl Iterator<Item = Node<'d>> + '_ {
        self.order.iter().copied()
    }

    pub(super) fn find(&self, kind: Kind, name: &str) -> Option<Node<'d>> {
        self.found.get(&(kind, name)).copied()
    }

    /// Returns a component, or an error if it is missing.
    pub(super) fn get(
        &self,
        from: Node<'d>,
        kind: Kind,
        what: &'static str,
        name: &'d str,
    ) -> Result<Node<'d>, CompileError> {
        let Resolved::Own(local) = self.resolve(from, name)? else {
            return refuse(from, Problem::Missing(what, name.to_owned()));
        };
        self.find(kind, local)
            .ok_or_else(|| CompileError::at(from, Problem::Missing(what, name.to_owned())))
    }

    /// Resolves a qualified name with the namespaces in scope.
    pub(super) fn resolve<'n>(
        &self,
        node: Node<'d>,
        name: &'n str,
    ) -> Result<Resolved<'n>, CompileError> {
        let name = name.trim();
        let (prefix, local) = name.split_once(':').unwrap_or(("", name));
        let namespace = namespace_of(node, prefix);
        match namespace {
            Some(XSD) => Ok(Resolved::BuiltIn(local)),
            None if prefix.is_empty() => Ok(Resolved::Own(local)),
            Some(other) if self.namespace == Some(other) => Ok(Resolved::Own(local)),
            _ => refuse(node, Problem::Missing("namespace of", name.to_owned())),
        }
    }
}

/// Returns the namespace bound to a prefix at `node`.
fn namespace_of<'d>(node: Node<'d>, prefix: &str) -> Option<&'d str> {
    let declares = |node: Node<'d>| {
        node.attributes().find_map(|attribute| {
            let declared = match attribute.name().strip_prefix("xmlns") {
                Some("") => "",
                Some(rest) => rest.strip_prefix(':')?,
                None => return None,
            };
            (declared == prefix).then(|| attribute.value())
        })
    };
    declares(node).or_else(|| node.ancestors().find_map(declares))
}

fn schema_root<'d>(document: &Document<'d>) -> Result<Node<'d>, CompileError> {
    if let Some(fault) = document.faults().find(|fault| fault.code.makes_partial()) {
        return Err(CompileError::ill_formed(
            document.position(fault.offset),
            fault.text,
        ));
    }
    let root = document
        .root()
        .ok_or_else(|| CompileError::somewhere_in(document.path(), Problem::NotASchema))?;
    let is_schema = root.is("schema") && namespace_of(root, root.prefix()) == Some(XSD);
    if is_schema {
        Ok(root)
    } else {
        refuse(root, Problem::NotASchema)
    }
}

fn include(node: Node<'_>, names: &[&str]) -> Result<(), CompileError> {
    only_attributes(node, &["schemaLocation"])?;
    let location = required(node, "schemaLocation")?;
    if names.contains(&file_name(location)) {
        return Ok(());
    }
    refuse(node, Problem::NotGiven(location.to_owned()))
}

fn file_name(path: &str) -> &str {
    path.rsplit(['/', '\\']).next().unwrap_or(path)
}

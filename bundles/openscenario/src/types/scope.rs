//! Scope of parameters. A declaration is in scope in the element around its
//! `ParameterDeclarations`. The innermost declaration of a name wins. A catalog's entry sees only
//! its own declarations.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::Node;

use crate::Version;
use crate::types::data_type::DataType;
use crate::types::declaration::{Declaration, Declared};
use crate::types::faults::{Problem, ValueFaultKind};
use crate::types::reading::{Expected, resolve};
use crate::types::text::bare;

/// The declarations of one element.
#[derive(Debug, Clone, Default)]
pub(crate) struct Frame<'d> {
    pub(crate) declarations: Vec<Declaration<'d>>,
    /// Index of the first declaration of each name.
    by_name: HashMap<&'d str, u32>,
}

impl<'d> Frame<'d> {
    fn push(&mut self, declaration: Declaration<'d>) {
        let at = u32::try_from(self.declarations.len()).unwrap_or(u32::MAX);
        self.by_name.entry(declaration.name).or_insert(at);
        self.declarations.push(declaration);
    }

    pub(crate) fn get(&self, name: &str) -> Option<&Declaration<'d>> {
        self.declarations.get(*self.by_name.get(name)? as usize)
    }
}

/// Number of a context in its scenario. 0 is the checked document.
pub(crate) type ContextId = u32;

/// Context in which values are read: a document, or a catalog entry with the assigned values of its
/// reference.
#[derive(Debug, Clone)]
pub(crate) struct Context<'d> {
    /// The root of the document, or the entry.
    pub(crate) top: Node<'d>,
    /// The `CatalogReference` that leads here, and its context.
    pub(crate) reference: Option<(Node<'d>, ContextId)>,
    /// Number of references that lead from the document to here.
    pub(crate) depth: u32,
    /// Frames by the index of the element that they apply to.
    frames: HashMap<u32, Frame<'d>>,
}

/// A fault in the value of a declaration.
pub(crate) type DeclarationProblem<'d> = (Node<'d>, Problem<'d>);

impl<'d> Context<'d> {
    /// Reads the declarations below `top` in document order. `assigned` replaces values of the
    /// parameters that `top` itself declares.
    pub(crate) fn new(
        top: Node<'d>,
        version: Version,
        assigned: &HashMap<&'d str, Declared<'d>>,
    ) -> (Context<'d>, Vec<DeclarationProblem<'d>>) {
        let mut context = Context {
            top,
            reference: None,
            depth: 0,
            frames: HashMap::new(),
        };
        let mut problems = Vec::new();
        for block in top.descendants_named("ParameterDeclarations") {
            let Some(holder) = block.parent() else {
                continue;
            };
            for node in block.children_named("ParameterDeclaration") {
                let declared = context.declare(node, version, &mut problems);
                let own = if holder == top {
                    assigned.get(declared.name)
                } else {
                    None
                };
                let declared = match own {
                    Some(value) => Declaration {
                        declared: value.clone(),
                        ..declared
                    },
                    None => declared,
                };
                context
                    .frames
                    .entry(holder.index())
                    .or_default()
                    .push(declared);
            }
        }
        (context, problems)
    }

    fn declare(
        &self,
        node: Node<'d>,
        version: Version,
        problems: &mut Vec<DeclarationProblem<'d>>,
    ) -> Declaration<'d> {
        let name = bare(node.attr("name").unwrap_or(""));
        let data_type = node
            .attr("parameterType")
            .and_then(DataType::of_declaration);
        let expected = data_type.map_or(Expected::Unknown, Expected::Type);
        let declared = match node.attr("value") {
            None => Declared::Faulty,
            Some(raw) => match resolve(raw, expected, version, &|name| self.get(node, name)) {
                Ok(value) => Declared::Value(value),
                Err(mut problem) => {
                    if problem.kind == ValueFaultKind::Undeclared {
                        self.explain_order(node, &mut problem);
                    }
                    let value = problem.value.take();
                    problems.push((node, problem));
                    value.map_or(Declared::Faulty, Declared::Value)
                }
            },
        };
        Declaration {
            node,
            name,
            data_type,
            declared,
        }
    }

    /// Explains that a parameter is declared, but not before its use.
    fn explain_order(&self, node: Node<'d>, problem: &mut Problem<'d>) {
        let block = node.parent();
        let later = block
            .into_iter()
            .flat_map(|block| block.children_named("ParameterDeclaration"));
        let mut later = later.skip_while(|other| *other != node);
        let is_it = |name: &str| bare(name) == problem.name;
        let later = later.find(|other| other.attr("name").is_some_and(is_it));
        if let Some(later) = later {
            problem.kind = ValueFaultKind::Order;
            let name = &problem.name;
            let found = if later == node {
                format!("`${name}` is the parameter that is being declared")
            } else {
                let row = later.position().row;
                format!("`${name}` is declared only later, in row {row}")
            };
            problem.text = format!(
                "{found}; a declaration may use only parameters that are declared before it"
            );
        }
    }

    /// Returns the declaration that a name means at a node.
    pub(crate) fn get(&self, node: Node<'d>, name: &str) -> Option<&Declaration<'d>> {
        if self.frames.is_empty() {
            return None;
        }
        let around = std::iter::once(node).chain(node.ancestors());
        for holder in around {
            if let Some(found) = self.frame(holder).and_then(|frame| frame.get(name)) {
                return Some(found);
            }
            if holder == self.top {
                return None;
            }
        }
        None
    }

    /// Returns the declarations of an element.
    pub(crate) fn frame(&self, holder: Node<'d>) -> Option<&Frame<'d>> {
        self.frames.get(&holder.index())
    }

    /// Returns all names in scope at a node, the innermost first.
    pub(crate) fn names(&self, node: Node<'d>) -> impl Iterator<Item = &'d str> {
        let around = std::iter::once(node).chain(node.ancestors());
        around
            .filter_map(|holder| self.frame(holder))
            .flat_map(|frame| frame.declarations.iter().map(|one| one.name))
    }
}

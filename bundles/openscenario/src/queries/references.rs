//! References to catalogs: a scenario follows them when it is built.

use std::sync::OnceLock;

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::Node;

use crate::queries::element::Element;
use crate::queries::scenario::Scenario;
use crate::types::catalogs::{AssignmentProblem, CatalogKind, Link, Resolution};
use crate::types::data_type::DataType;
use crate::types::declaration::Declared;
use crate::types::faults::ValueFaultKind;
use crate::types::inputs::Inputs;
use crate::types::reading::{Expected, resolve};
use crate::types::scope::{Context, ContextId};
use crate::types::text::bare;

/// Maximum depth of references from entry to entry.
const MAX_DEPTH: u32 = 8;
/// Maximum number of followed references.
const MAX_REFERENCES: usize = 50_000;

impl<'d> Scenario<'d> {
    /// Reads declarations and follows references to catalogs. The rest is read on first use.
    /// Returns `None` if the document has no root element.
    pub fn new(inputs: &Inputs<'d>) -> Option<Scenario<'d>> {
        Scenario::with_values(inputs, &HashMap::new())
    }

    /// Like [`new`](Scenario::new), with values for parameters that the document itself declares,
    /// as a distribution sets them.
    pub fn with_values(
        inputs: &Inputs<'d>,
        values: &HashMap<&'d str, Declared<'d>>,
    ) -> Option<Scenario<'d>> {
        let mut scenario = Scenario::of_document(inputs, values)?;
        scenario.follow_references();
        // Names that are written as parameters may have been read before all documents were known.
        scenario.typings = OnceLock::new();
        Some(scenario)
    }

    /// Follows every reference to a catalog, including references within entries.
    fn follow_references(&mut self) {
        let mut next = 0;
        while next < self.contexts.len() && self.contexts.len() < MAX_REFERENCES {
            let context = u32::try_from(next).unwrap_or(0);
            next += 1;
            let (top, depth) = (self.context(context).top, self.context(context).depth);
            for reference in top.descendants_named("CatalogReference") {
                let link = self.follow(reference, context, depth);
                self.links.insert((context, reference.index()), link);
            }
        }
    }

    fn follow(&mut self, reference: Node<'d>, context: ContextId, depth: u32) -> Link<'d> {
        let element = self.element_in(context, reference);
        let parent = reference.parent().map_or("", |parent| parent.name());
        let kinds = CatalogKind::of_reference(parent);
        let names = element.text("catalogName").zip(element.text("entryName"));
        let resolution = match names {
            Some((catalog, entry)) if !kinds.is_empty() => {
                self.catalogs.find(kinds, &catalog, &entry)
            }
            _ => Resolution::Unknown,
        };
        let context = match &resolution {
            Resolution::Entry(entry) | Resolution::OtherLocation(entry) if depth < MAX_DEPTH => {
                Some(self.enter(reference, context, depth, entry.node))
            }
            _ => None,
        };
        Link {
            resolution,
            context,
        }
    }

    fn enter(
        &mut self,
        reference: Node<'d>,
        outer: ContextId,
        depth: u32,
        entry: Node<'d>,
    ) -> ContextId {
        let mut assigned: HashMap<&'d str, Declared<'d>> = HashMap::new();
        for assignment in assignments(reference) {
            let Some((name, value)) = self.assigned(assignment, outer, entry) else {
                continue;
            };
            assigned.entry(name).or_insert(value);
        }
        let (mut context, _) = Context::new(entry, self.version(), &assigned);
        context.reference = Some((reference, outer));
        context.depth = depth + 1;
        self.contexts.push(context);
        u32::try_from(self.contexts.len() - 1).unwrap_or(0)
    }

    /// Returns the parameter of an assignment, and its value in the type that the entry declares.
    fn assigned(
        &mut self,
        assignment: Node<'d>,
        outer: ContextId,
        entry: Node<'d>,
    ) -> Option<(&'d str, Declared<'d>)> {
        let name = bare(assignment.attr("parameterRef")?);
        let declared = declaration(entry, name)?;
        let data_type = declared
            .attr("parameterType")
            .and_then(DataType::of_declaration);
        let expected = data_type.map_or(Expected::Unknown, Expected::Type);
        let raw = assignment.attr("value")?;
        let read_in = self.context(outer);
        match resolve(raw, expected, self.version(), &|name| {
            read_in.get(assignment, name)
        }) {
            Ok(value) => Some((name, Declared::Value(value))),
            Err(mut problem) => {
                let value = problem.value.take();
                let about_type = matches!(
                    problem.kind,
                    ValueFaultKind::Declared
                        | ValueFaultKind::Parameter
                        | ValueFaultKind::Result
                        | ValueFaultKind::Narrowed
                );
                if about_type && outer == 0 {
                    self.assignment_problems.push(AssignmentProblem {
                        assignment,
                        problem,
                    });
                }
                Some((name, value.map_or(Declared::Faulty, Declared::Value)))
            }
        }
    }

    /// Returns the target of a `CatalogReference`.
    pub fn resolution(&self, reference: Element<'_, 'd>) -> &Resolution<'d> {
        let link = self.links.get(&(reference.context, reference.node.index()));
        link.map_or(&Resolution::Unknown, |link| &link.resolution)
    }

    /// Returns the entry that a `CatalogReference` leads to, with the assigned parameters applied.
    pub fn entry(&self, reference: Element<'_, 'd>) -> Option<Element<'_, 'd>> {
        let context = self
            .links
            .get(&(reference.context, reference.node.index()))?
            .context?;
        Some(self.element_in(context, self.context(context).top))
    }

    /// Returns the `Directory` element for the catalogs of a kind.
    pub fn catalog_directory(&self, kind: CatalogKind) -> Option<Element<'_, 'd>> {
        self.catalogs.directory(kind).map(|node| self.element(node))
    }

    /// Returns all catalogs that were read, with the kind of their directory, in no order.
    pub fn catalogs(&self) -> impl Iterator<Item = (Option<CatalogKind>, Node<'d>)> {
        self.catalogs
            .all()
            .flat_map(|(_, found)| found.iter().copied())
    }

    /// Returns assigned values that do not fit the parameter of the entry: the
    /// `ParameterAssignment` and the fault, in document order.
    pub fn assignment_faults(
        &self,
    ) -> impl Iterator<Item = (Element<'_, 'd>, ValueFaultKind, &str)> {
        self.assignment_problems.iter().map(|one| {
            (
                self.element(one.assignment),
                one.problem.kind,
                one.problem.text.as_str(),
            )
        })
    }
}

impl<'m, 'd> Element<'m, 'd> {
    /// Returns the assignments of a `CatalogReference`.
    pub fn assignments(self) -> impl Iterator<Item = Element<'m, 'd>> {
        assignments(self.node).map(move |node| Element { node, ..self })
    }

    /// Returns the child with one of these names. Otherwise returns the entry with one of these
    /// names that a `CatalogReference` in its place leads to.
    pub fn child_or_entry(self, names: &[&str]) -> Option<Element<'m, 'd>> {
        let own = self.children().find(|child| names.contains(&child.name()));
        own.or_else(|| {
            let references = self.children_named("CatalogReference");
            let mut entries = references.filter_map(|reference| self.scenario.entry(reference));
            entries.find(|entry| names.contains(&entry.name()))
        })
    }
}

/// Returns the assignments of a reference.
pub(super) fn assignments(reference: Node<'_>) -> impl Iterator<Item = Node<'_>> {
    let block = reference.child("ParameterAssignments");
    block
        .into_iter()
        .flat_map(|block| block.children_named("ParameterAssignment"))
}

/// Returns the declaration of a parameter by the entry itself.
fn declaration<'d>(entry: Node<'d>, name: &str) -> Option<Node<'d>> {
    let block = entry.child("ParameterDeclarations")?;
    block
        .children_named("ParameterDeclaration")
        .find(|one| one.attr("name").is_some_and(|own| bare(own) == name))
}

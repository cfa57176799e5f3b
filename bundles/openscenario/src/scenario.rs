//! The whole scenario: the checked document with its catalogs and its map.

use std::sync::OnceLock;

use foldhash::{HashMap, HashMapExt as _, HashSet};
use qcbus_document::{Attribute, Document, FileKind, Named, Node};
use qcbus_schema::Typing;

use crate::Version;
use crate::catalogs::{AssignmentProblem, Catalogs, Link, assignments};
use crate::data_type::DataType;
use crate::element::Element;
use crate::entities::Entities;
use crate::expr::{self, Evaluated};
use crate::faults::{ValueFault, ValueFaultKind};
use crate::form::Form;
use crate::inputs::{Inputs, LinkedMap};
use crate::reading::{self, Expected, Reading, resolve};
use crate::scope::{Context, ContextId, DeclarationProblem, Declared, operand};
use crate::storyboard::Storyboard;

/// An OpenSCENARIO document and everything that it refers to.
pub struct Scenario<'d> {
    document: Document<'d>,
    version: Version,
    form: Form,
    map: LinkedMap,
    /// Contexts. The list is never empty: the first is the document.
    contexts: Vec<Context<'d>>,
    /// Catalogs that references are looked up in.
    pub(crate) catalogs: Catalogs<'d>,
    pub(crate) links: HashMap<(ContextId, u32), Link<'d>>,
    pub(crate) assignment_problems: Vec<AssignmentProblem<'d>>,
    declaration_problems: Vec<DeclarationProblem<'d>>,
    kind: FileKind,
    typings: OnceLock<HashMap<usize, Option<Typing>>>,
    variables: OnceLock<HashSet<&'d str>>,
    with_dollar: OnceLock<Vec<Attribute<'d>>>,
    faults: OnceLock<Vec<ValueFault<'d>>>,
    /// Faults in catalog entries, each with the context of its entry.
    entry_faults: OnceLock<Vec<(ContextId, ValueFault<'d>)>>,
    entities: OnceLock<Entities<'d>>,
    storyboard: OnceLock<Storyboard<'d>>,
}

/// Version that is assumed for files without a version.
const NEWEST: Version = (1, 4);

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
        let root = inputs.document.root()?;
        let version = inputs.version.unwrap_or(NEWEST);
        let (context, declaration_problems) = Context::new(root, version, values);
        let mut scenario = Scenario {
            document: inputs.document,
            version,
            form: Form::of(&inputs.document),
            map: inputs.map.clone(),
            contexts: vec![context],
            catalogs: Catalogs::new(root, &inputs.catalogs, &inputs.incomplete),
            links: HashMap::new(),
            assignment_problems: Vec::new(),
            declaration_problems,
            kind: inputs.kind,
            typings: OnceLock::new(),
            variables: OnceLock::new(),
            with_dollar: OnceLock::new(),
            faults: OnceLock::new(),
            entry_faults: OnceLock::new(),
            entities: OnceLock::new(),
            storyboard: OnceLock::new(),
        };
        scenario.follow_references();
        // Names that are written as parameters may have been read before all documents were known.
        scenario.typings = OnceLock::new();
        Some(scenario)
    }

    /// Returns the checked document.
    pub fn document(&self) -> Document<'d> {
        self.document
    }

    /// Returns the version in the file header, or the newest version if there is none.
    pub fn version(&self) -> Version {
        self.version
    }

    /// Returns the kind of file.
    pub(crate) fn kind(&self) -> FileKind {
        self.kind
    }

    /// Returns the form of the document.
    pub fn form(&self) -> Form {
        self.form
    }

    /// Returns the root element.
    pub fn root(&self) -> Element<'_, 'd> {
        Element {
            scenario: self,
            node: self.contexts[0].top,
            context: 0,
        }
    }

    /// Returns the elements of a name in the document itself, in document order.
    pub fn elements(&self, name: &str) -> impl Iterator<Item = Element<'_, 'd>> {
        self.document.elements(name).map(|node| Element {
            scenario: self,
            node,
            context: 0,
        })
    }

    /// Returns an element of the document itself.
    pub fn element(&self, node: Node<'d>) -> Element<'_, 'd> {
        Element {
            scenario: self,
            node,
            context: 0,
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
        (0..).zip(&self.contexts).map(|(context, one)| Element {
            scenario: self,
            node: one.top,
            context,
        })
    }

    pub(crate) fn context(&self, id: ContextId) -> &Context<'d> {
        self.contexts.get(id as usize).unwrap_or(&self.contexts[0])
    }

    pub(crate) fn contexts(&self) -> usize {
        self.contexts.len()
    }

    pub(crate) fn push_context(&mut self, context: Context<'d>) -> ContextId {
        self.contexts.push(context);
        u32::try_from(self.contexts.len() - 1).unwrap_or(0)
    }

    pub(crate) fn map_input(&self) -> &LinkedMap {
        &self.map
    }

    /// Returns the entities and selections.
    pub fn entities(&self) -> &Entities<'d> {
        self.entities.get_or_init(|| Entities::of(self))
    }

    /// Returns the storyboard's tree, including maneuvers from catalogs.
    pub fn storyboard(&self) -> &Storyboard<'d> {
        self.storyboard.get_or_init(|| Storyboard::of(self))
    }

    /// Returns the types of the elements of the document that a context reads.
    pub(crate) fn typing(&self, context: ContextId) -> Option<&Typing> {
        let typings = self.typings.get_or_init(|| self.read_typings());
        typings
            .get(&key(self.context(context).top.document()))?
            .as_ref()
    }

    fn read_typings(&self) -> HashMap<usize, Option<Typing>> {
        let mut typings = HashMap::new();
        for context in &self.contexts {
            let document = context.top.document();
            typings.entry(key(document)).or_insert_with(|| {
                let stated = qcbus_schema::version_of(&document, self.kind);
                let version = stated.unwrap_or(qcbus_schema::Version {
                    major: u32::from(self.version.0),
                    minor: u32::from(self.version.1),
                });
                Typing::of(&document, FileKind::Xosc, version)
            });
        }
        typings
    }

    pub(crate) fn read(&self, attribute: Attribute<'d>, context: ContextId) -> Reading<'d> {
        let raw = attribute.value();
        if reading::Form::of(raw) == reading::Form::Literal || is_plain(attribute) {
            return Reading::Literal(raw);
        }
        match self.evaluate(attribute, raw, context) {
            Ok(value) => Reading::Value(value),
            Err(problem) => problem.value.map_or(Reading::Unknown, Reading::Value),
        }
    }

    fn evaluate(
        &self,
        attribute: Attribute<'d>,
        raw: &'d str,
        context: ContextId,
    ) -> Result<crate::Value<'d>, crate::faults::Problem<'d>> {
        self.evaluate_in(attribute, raw, context, self.context(context))
    }

    /// Like `evaluate`, with the parameters of another context.
    fn evaluate_in(
        &self,
        attribute: Attribute<'d>,
        raw: &'d str,
        context: ContextId,
        read_in: &Context<'d>,
    ) -> Result<crate::Value<'d>, crate::faults::Problem<'d>> {
        let node = attribute.node();
        let expected = self.expected(attribute, context);
        resolve(raw, expected, self.version, &|name| read_in.get(node, name))
    }

    /// Returns the expected kind of an attribute's value.
    fn expected(&self, attribute: Attribute<'d>, context: ContextId) -> Expected {
        let node = attribute.node();
        if attribute.is("value") {
            // The schema declares text here. The declaration names the true type.
            let declared = match node.name() {
                "ParameterDeclaration" => node.attr("parameterType"),
                "VariableDeclaration" => node.attr("variableType"),
                "ParameterAssignment"
                | "ParameterSetAction"
                | "SetAction"
                | "VariableSetAction"
                | "ParameterCondition"
                | "VariableCondition"
                | "ValueConstraint" => {
                    return Expected::Unknown;
                }
                _ => None,
            };
            if let Some(data_type) = declared.and_then(DataType::of_declaration) {
                return Expected::Type(data_type);
            }
        }
        let value = self
            .typing(context)
            .and_then(|typing| typing.value(attribute));
        let Some(value) = value else {
            return Expected::Unknown;
        };
        match (value.words(), value.name().and_then(DataType::of_schema)) {
            (Some(words), _) => Expected::Words(words),
            (None, Some(data_type)) => Expected::Type(data_type),
            (None, None) => Expected::Unknown,
        }
    }

    /// Returns every value of the document that cannot be resolved as written, in document order.
    /// Consequences of another fault are left out.
    pub fn faults(&self) -> &[ValueFault<'d>] {
        self.faults.get_or_init(|| self.find_faults())
    }

    /// Returns the faults of the given kinds.
    pub fn faults_of(&self, kinds: &[ValueFaultKind]) -> impl Iterator<Item = &ValueFault<'d>> {
        self.faults()
            .iter()
            .filter(move |fault| kinds.contains(&fault.kind))
    }

    fn find_faults(&self) -> Vec<ValueFault<'d>> {
        let mut faults: Vec<ValueFault<'d>> = Vec::new();
        let mut note = |attribute: Attribute<'d>, problem: &crate::faults::Problem<'d>| {
            if !problem.is_silent() {
                faults.push(self.explained(attribute, 0, problem));
            }
        };
        for (node, problem) in &self.declaration_problems {
            if let Some(attribute) = node.attribute("value") {
                note(attribute, problem);
            }
        }
        for attribute in self
            .substituted(0)
            .filter(|attribute| !is_declared_value(*attribute))
        {
            if let Err(problem) = self.evaluate(attribute, attribute.value(), 0) {
                note(attribute, &problem);
            }
        }
        faults.sort_by_key(|fault| fault.attribute.offset());
        faults
    }

    /// Returns the faults of the given kinds in the catalog entries that the document refers to.
    /// Faults caused by assigned values are listed at every reference. Faults of the entry itself
    /// are listed once, at the first reference.
    pub fn entry_faults_of(
        &self,
        kinds: &[ValueFaultKind],
    ) -> impl Iterator<Item = (Element<'_, 'd>, &ValueFault<'d>)> {
        let all = self.entry_faults.get_or_init(|| self.find_entry_faults());
        let wanted = all
            .iter()
            .filter(move |(_, fault)| kinds.contains(&fault.kind));
        wanted.map(|(context, fault)| {
            let element = Element {
                scenario: self,
                node: fault.attribute.node(),
                context: *context,
            };
            (element, fault)
        })
    }

    fn find_entry_faults(&self) -> Vec<(ContextId, ValueFault<'d>)> {
        let mut faults = Vec::new();
        let mut defaults: HashMap<Node<'d>, Context<'d>> = HashMap::new();
        for (id, context) in (0..).zip(&self.contexts) {
            let Some((reference, _)) = context.reference else {
                continue;
            };
            let is_first = !defaults.contains_key(&context.top);
            if !is_first && reference.child("ParameterAssignments").is_none() {
                continue;
            }
            if is_first {
                let (default, problems) = Context::new(context.top, self.version, &HashMap::new());
                self.declared_faults(id, reference, &problems, &mut faults);
                defaults.insert(context.top, default);
            }
            let Some(default) = defaults.get(&context.top) else {
                continue;
            };
            for attribute in self.substituted(id).filter(|it| !is_declared_value(*it)) {
                let Err(problem) = self.evaluate(attribute, attribute.value(), id) else {
                    continue;
                };
                let by_default = self.evaluate_in(attribute, attribute.value(), id, default);
                let as_ever = by_default.is_err_and(|other| other.kind == problem.kind);
                if !problem.is_silent() && (is_first || !as_ever) {
                    faults.push((id, self.explained(attribute, id, &problem)));
                }
            }
        }
        faults
    }

    /// Adds the faults in the defaults of an entry's parameters. Parameters that the reference
    /// assigns are left out.
    fn declared_faults(
        &self,
        id: ContextId,
        reference: Node<'d>,
        problems: &[DeclarationProblem<'d>],
        faults: &mut Vec<(ContextId, ValueFault<'d>)>,
    ) {
        let assigned: Vec<&str> = assignments(reference)
            .filter_map(|assignment| assignment.attr("parameterRef"))
            .collect();
        for (node, problem) in problems {
            let is_assigned = node
                .attr("name")
                .is_some_and(|name| assigned.contains(&name));
            if let Some(attribute) = node.attribute("value")
                && !is_assigned
                && !problem.is_silent()
            {
                faults.push((id, self.explained(attribute, id, problem)));
            }
        }
    }

    /// Returns the attributes of the document that are written as expressions, in document order,
    /// even if faulty. Attributes that the schema declares as text are left out.
    pub fn written_expressions(&self) -> impl Iterator<Item = Attribute<'d>> {
        self.substituted(0).filter(|attribute| {
            let is_text = || {
                matches!(
                    self.expected(*attribute, 0),
                    Expected::Words(_) | Expected::Type(DataType::String | DataType::DateTime)
                )
            };
            reading::Form::of(attribute.value()) == reading::Form::Expression && !is_text()
        })
    }

    /// Returns every expression of the document that has a value, in document order. Attributes
    /// that the schema declares as text are left out.
    pub fn expressions(&self) -> impl Iterator<Item = (Attribute<'d>, Evaluated)> {
        self.written_expressions().filter_map(|attribute| {
            let context = &self.contexts[0];
            let lookup = |name: &str| operand(context.get(attribute.node(), name));
            let evaluated = expr::evaluate(attribute.value(), self.version, &lookup).ok()?;
            Some((attribute, evaluated))
        })
    }

    /// Returns every use of a parameter in the document: the attribute and the parameter's name.
    pub fn parameter_uses(&self) -> impl Iterator<Item = (Attribute<'d>, &'d str)> {
        self.substituted(0).flat_map(|attribute| {
            let raw = attribute.value();
            let names: Vec<&'d str> = match reading::Form::of(raw) {
                reading::Form::Parameter(name) | reading::Form::Embedded(_, name) => vec![name],
                reading::Form::Expression => {
                    expr::names(raw).into_iter().map(|(name, _)| name).collect()
                }
                reading::Form::Literal | reading::Form::Ros(_) => Vec::new(),
            };
            names.into_iter().map(move |name| (attribute, name))
        })
    }

    /// Returns the attributes of the document that contain a `$`, in document order.
    pub fn with_dollar(&self) -> &[Attribute<'d>] {
        self.with_dollar
            .get_or_init(|| with_dollar(self.contexts[0].top).collect())
    }

    /// Returns the attributes of the document, or of an entry, that are not literals.
    fn substituted(&self, context: ContextId) -> impl Iterator<Item = Attribute<'d>> {
        let (document, entry) = match context {
            0 => (self.with_dollar(), None),
            _ => (&[][..], Some(with_dollar(self.context(context).top))),
        };
        let all = document.iter().copied().chain(entry.into_iter().flatten());
        all.filter(|attribute| {
            reading::Form::of(attribute.value()) != reading::Form::Literal && !is_plain(*attribute)
        })
    }

    /// Adds the knowledge of the whole scenario to a fault.
    fn explained(
        &self,
        attribute: Attribute<'d>,
        context: ContextId,
        problem: &crate::faults::Problem<'d>,
    ) -> ValueFault<'d> {
        let mut fault = ValueFault {
            attribute,
            kind: problem.kind,
            at: problem.at,
            name: problem.name.clone(),
            text: problem.text.clone(),
            said_by_schema: self.is_foreign_to_schema(attribute, context),
        };
        if fault.kind == ValueFaultKind::Undeclared {
            let element = Element {
                scenario: self,
                node: attribute.node(),
                context,
            };
            // A catalog entry has no access to the scenario and its variables.
            if element.reference().is_none() && self.declares_variable(&fault.name) {
                fault.kind = ValueFaultKind::Variable;
                fault.text = format!(
                    "`{}` is a variable, and its value is known only when the scenario runs; `$` refers to \
                     parameters only",
                    fault.name
                );
            } else {
                // This is enough to find a typo. The limit bounds the work if thousands of names
                // meet thousands of faults.
                let names = element.parameter_names().take(500);
                if let Some(near) = qcbus_schema::closest(&fault.name, names) {
                    fault.text.push_str(&format!("; `${near}` is"));
                }
            }
        }
        fault
    }

    /// Checks whether the attribute's type in the schema never admits the written notation. A
    /// version without its own schema is not judged by another one, except as an information.
    fn is_foreign_to_schema(&self, attribute: Attribute<'d>, context: ContextId) -> bool {
        let (major, minor) = (u32::from(self.version.0), u32::from(self.version.1));
        let version = qcbus_schema::Version { major, minor };
        let mut shipped = qcbus_schema::SHIPPED.iter();
        let own = shipped.any(|one| one.kind == FileKind::Xosc && one.version == version);
        let value = self
            .typing(context)
            .and_then(|typing| typing.value(attribute));
        let Some(value) = value.filter(|_| own) else {
            return false;
        };
        let data_type = match (value.words(), value.name().and_then(DataType::of_schema)) {
            (None, None | Some(DataType::String)) => return false,
            (Some(_), _) => None,
            (None, data_type) => data_type,
        };
        let raw = attribute.value();
        match reading::Form::of(raw) {
            reading::Form::Literal | reading::Form::Parameter(_) => false,
            reading::Form::Embedded(..) | reading::Form::Ros(_) => true,
            reading::Form::Expression => {
                let takes_one = data_type.is_some_and(|one| one != DataType::DateTime);
                !takes_one || self.version < (1, 1) || !expr::is_of_schema(raw)
            }
        }
    }

    fn declares_variable(&self, name: &str) -> bool {
        let variables = self.variables.get_or_init(|| {
            let block = self.root().child("VariableDeclarations");
            let declarations = block
                .into_iter()
                .flat_map(|block| block.children_named("VariableDeclaration"));
            declarations
                .filter_map(|variable| variable.written("name"))
                .collect()
        });
        variables.contains(name)
    }
}

fn with_dollar<'d>(top: Node<'d>) -> impl Iterator<Item = Attribute<'d>> {
    let all = std::iter::once(top).chain(top.descendants());
    all.flat_map(|node| node.attributes())
        .filter(|attribute| attribute.value().contains('$'))
}

/// Returns a key for a document: the address of its path text in memory.
fn key(document: Document<'_>) -> usize {
    document.path().as_ptr() as usize
}

/// Checks for names of declared or assigned objects. They are plain names, even if old files write
/// a `$` before them.
fn is_plain(attribute: Attribute<'_>) -> bool {
    match attribute.name() {
        "name" => matches!(
            attribute.node().name(),
            "ParameterDeclaration" | "VariableDeclaration" | "MonitorDeclaration"
        ),
        "parameterRef" => true,
        name => name == "xmlns" || name.starts_with("xmlns:") || name.starts_with("xsi:"),
    }
}

/// Checks for the value of a parameter declaration. It is read with its declaration.
fn is_declared_value(attribute: Attribute<'_>) -> bool {
    attribute.is("value") && attribute.node().is("ParameterDeclaration")
}

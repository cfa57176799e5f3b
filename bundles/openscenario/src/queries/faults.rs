//! Faults of values that are not literals, with the knowledge of the whole scenario.

use foldhash::{HashMap, HashMapExt as _};
use qcbus_document::{Attribute, FileKind, Node};

use crate::expr;
use crate::queries::element::Element;
use crate::queries::references::assignments;
use crate::queries::scenario::Scenario;
use crate::types::data_type::DataType;
use crate::types::faults::{Problem, ValueFault, ValueFaultKind};
use crate::types::reading;
use crate::types::scope::{Context, ContextId, DeclarationProblem};

impl<'d> Scenario<'d> {
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
        let mut note = |attribute: Attribute<'d>, problem: &Problem<'d>| {
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
            let node = fault.attribute.node();
            (self.element_in(*context, node), fault)
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

    /// Adds the knowledge of the whole scenario to a fault.
    fn explained(
        &self,
        attribute: Attribute<'d>,
        context: ContextId,
        problem: &Problem<'d>,
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
            let element = self.element_in(context, attribute.node());
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

/// Checks for the value of a parameter declaration. It is read with its declaration.
fn is_declared_value(attribute: Attribute<'_>) -> bool {
    attribute.is("value") && attribute.node().is("ParameterDeclaration")
}

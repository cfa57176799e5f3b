//! The whole scenario: the checked document with its catalogs and its map.

use std::sync::OnceLock;

use foldhash::{HashMap, HashMapExt as _, HashSet};
use qcbus_document::{Attribute, Document, FileKind};
use qcbus_schema::Typing;

use crate::Version;
use crate::timeline::Timeline;
use crate::types::catalogs::{AssignmentProblem, Catalogs, Link};
use crate::types::data_type::{DataType, Value};
use crate::types::declaration::Declared;
use crate::types::entities::Entities;
use crate::types::faults::{Problem, ValueFault};
use crate::types::form::Form;
use crate::types::inputs::{Inputs, LinkedMap};
use crate::types::reading::{self, Expected, Reading, resolve};
use crate::types::scope::{Context, ContextId, DeclarationProblem};
use crate::types::storyboard::Storyboard;

/// An OpenSCENARIO document and everything that it refers to.
pub struct Scenario<'d> {
    pub(super) document: Document<'d>,
    pub(super) version: Version,
    pub(super) form: Form,
    pub(super) map: LinkedMap,
    /// Contexts. The list is never empty: the first is the document.
    pub(super) contexts: Vec<Context<'d>>,
    /// Catalogs that references are looked up in.
    pub(super) catalogs: Catalogs<'d>,
    pub(super) links: HashMap<(ContextId, u32), Link<'d>>,
    pub(super) assignment_problems: Vec<AssignmentProblem<'d>>,
    pub(super) declaration_problems: Vec<DeclarationProblem<'d>>,
    pub(super) kind: FileKind,
    pub(super) typings: OnceLock<HashMap<usize, Option<Typing>>>,
    pub(super) variables: OnceLock<HashSet<&'d str>>,
    pub(super) with_dollar: OnceLock<Vec<Attribute<'d>>>,
    pub(super) faults: OnceLock<Vec<ValueFault<'d>>>,
    /// Faults in catalog entries, each with the context of its entry.
    pub(super) entry_faults: OnceLock<Vec<(ContextId, ValueFault<'d>)>>,
    pub(super) entities: OnceLock<Entities<'d>>,
    pub(super) storyboard: OnceLock<Storyboard<'d>>,
    pub(crate) timeline: OnceLock<Option<Timeline>>,
}

/// Version that is assumed for files without a version.
const NEWEST: Version = (1, 4);

impl<'d> Scenario<'d> {
    /// Reads the declarations of a document. References to catalogs are not followed yet. Returns
    /// `None` if the document has no root element.
    pub(super) fn of_document(
        inputs: &Inputs<'d>,
        values: &HashMap<&'d str, Declared<'d>>,
    ) -> Option<Scenario<'d>> {
        let root = inputs.document.root()?;
        let version = inputs.version.unwrap_or(NEWEST);
        let (context, declaration_problems) = Context::new(root, version, values);
        Some(Scenario {
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
            timeline: OnceLock::new(),
        })
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
    pub(super) fn kind(&self) -> FileKind {
        self.kind
    }

    /// Returns the form of the document.
    pub fn form(&self) -> Form {
        self.form
    }

    pub(super) fn context(&self, id: ContextId) -> &Context<'d> {
        self.contexts.get(id as usize).unwrap_or(&self.contexts[0])
    }

    /// Returns the types of the elements of the document that a context reads.
    pub(super) fn typing(&self, context: ContextId) -> Option<&Typing> {
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

    pub(super) fn read(&self, attribute: Attribute<'d>, context: ContextId) -> Reading<'d> {
        let raw = attribute.value();
        if reading::Form::of(raw) == reading::Form::Literal || is_plain(attribute) {
            return Reading::Literal(raw);
        }
        match self.evaluate(attribute, raw, context) {
            Ok(value) => Reading::Value(value),
            Err(problem) => problem.value.map_or(Reading::Unknown, Reading::Value),
        }
    }

    pub(super) fn evaluate(
        &self,
        attribute: Attribute<'d>,
        raw: &'d str,
        context: ContextId,
    ) -> Result<Value<'d>, Problem<'d>> {
        self.evaluate_in(attribute, raw, context, self.context(context))
    }

    /// Like `evaluate`, with the parameters of another context.
    pub(super) fn evaluate_in(
        &self,
        attribute: Attribute<'d>,
        raw: &'d str,
        context: ContextId,
        read_in: &Context<'d>,
    ) -> Result<Value<'d>, Problem<'d>> {
        let node = attribute.node();
        let expected = self.expected(attribute, context);
        resolve(raw, expected, self.version, &|name| read_in.get(node, name))
    }

    /// Returns the expected kind of an attribute's value.
    pub(super) fn expected(&self, attribute: Attribute<'d>, context: ContextId) -> Expected {
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
}

/// Returns a key for a document: the address of its path text in memory.
pub(super) fn key(document: Document<'_>) -> usize {
    document.path().as_ptr() as usize
}

/// Checks for names of declared or assigned objects. They are plain names, even if old files write
/// a `$` before them.
pub(super) fn is_plain(attribute: Attribute<'_>) -> bool {
    match attribute.name() {
        "name" => matches!(
            attribute.node().name(),
            "ParameterDeclaration" | "VariableDeclaration" | "MonitorDeclaration"
        ),
        "parameterRef" => true,
        name => name == "xmlns" || name.starts_with("xmlns:") || name.starts_with("xsi:"),
    }
}

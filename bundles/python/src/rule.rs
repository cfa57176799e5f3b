//! Rules that are functions of a script.

use std::any::{Any, TypeId};
use std::sync::Arc;

use pyo3::prelude::*;
use pyo3::types::PyDict;
use qcbus_document::{Document, FileKind};
use qcbus_sdk::{AnyRule, Built, Default, Facts, Sink, Subject, Unbuilt, Version};

use crate::document;
use crate::found::Found;
use crate::lease::Lease;

/// Model of all rules of scripts.
struct Views;

/// A rule: its metadata and its check function.
pub(crate) struct PyRule {
    pub(crate) facts: Facts,
    pub(crate) function: Py<PyAny>,
}

/// Documents of a job as Python objects. They are closed at the end of the job.
struct Shown<'d> {
    subject: &'d Subject<'d>,
    /// The root first, then the documents that it refers to.
    leases: Vec<Arc<Lease>>,
    root: Py<document::Document>,
}

impl Drop for Shown<'_> {
    fn drop(&mut self) {
        self.leases.iter().for_each(|lease| lease.close());
    }
}

impl<'d> Shown<'d> {
    fn open(py: Python<'_>, subject: &'d Subject<'d>) -> Result<Shown<'d>, Unbuilt> {
        if !subject.root().is_well_formed() {
            // A rule that reads only a part of the file would report no issues in the rest.
            let why = "the file is not well-formed XML, so only a part of it can be read";
            return Err(Unbuilt::Broken(why.to_owned()));
        }
        let failed = |error: &dyn std::fmt::Display| Unbuilt::Failed(format!("failed to {error}"));
        let open = |image| Lease::open(py, image).map_err(|error| failed(&error));
        let mut leases = vec![open(subject.image())?];
        let mut linked = Vec::new();
        for other in subject.linked() {
            let lease = open(other.image())?;
            let kind = kind_name(FileKind::of_path(other.path.as_ref()));
            let version = version_of(&other.document).map(numbers);
            let view =
                document::Document::new(lease.clone(), Some(other.role), kind, version, Vec::new());
            leases.push(lease);
            linked.push(Py::new(py, view).map_err(|error| failed(&error))?);
        }
        let kind = kind_name(Some(subject.kind()));
        let version = subject.version().map(numbers);
        let root = document::Document::new(leases[0].clone(), None, kind, version, linked);
        let root = Py::new(py, root).map_err(|error| failed(&error))?;
        Ok(Shown {
            subject,
            leases,
            root,
        })
    }

    fn document_of(&self, lease: &Arc<Lease>) -> Option<Document<'d>> {
        let at = self.leases.iter().position(|it| Arc::ptr_eq(it, lease))?;
        match at.checked_sub(1) {
            None => Some(self.subject.root()),
            Some(at) => self.subject.linked().get(at).map(|it| it.document),
        }
    }

    fn call(&self, py: Python<'_>, rule: &PyRule, sink: &mut Sink<'d>) -> PyResult<()> {
        let params = PyDict::new(py);
        for param in rule.facts.params {
            match param.default {
                Default::Number(_) => params.set_item(param.name, sink.number(param))?,
                Default::Flag(_) => params.set_item(param.name, sink.flag(param))?,
                Default::Text(_) => params.set_item(param.name, sink.text(param))?,
            }
        }
        let version = self.subject.version().map(numbers);
        let found = Bound::new(
            py,
            Found::new(rule.facts.uids, params, version, &self.leases),
        )?;
        let called = rule
            .function
            .call1(py, (self.root.clone_ref(py), found.clone()));
        // Findings before an exception are still valid.
        found.get().tell(sink, |lease| self.document_of(lease));
        called.map(drop)
    }
}

impl<'d> Built<'d> for Shown<'d> {
    fn parts(&self) -> usize {
        0
    }

    fn each(&self, _: usize, _: &dyn AnyRule, _: &mut Sink<'d>) {}

    fn run(&self, rule: &dyn AnyRule, found: &mut Sink<'d>) {
        let Some(rule) = rule.as_any().downcast_ref::<PyRule>() else {
            return;
        };
        Python::attach(|py| {
            if let Err(error) = self.call(py, rule, found) {
                found.fail(traceback(py, &error));
            }
        });
    }
}

impl AnyRule for PyRule {
    fn facts(&self) -> Facts {
        self.facts
    }

    fn model(&self) -> TypeId {
        TypeId::of::<Views>()
    }

    fn goes_by_parts(&self) -> bool {
        false
    }

    fn with_model<'d>(
        &self,
        subject: &'d Subject<'d>,
        hand: &mut dyn FnMut(&dyn Built<'d>),
    ) -> Result<(), Unbuilt> {
        let job = Python::attach(|py| Shown::open(py, subject))?;
        hand(&job);
        Ok(())
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}

/// Returns a Python traceback with the last line first, because lists show only the first line.
fn traceback(py: Python<'_>, error: &PyErr) -> String {
    let kind = error.get_type(py).name().map(|it| it.to_string());
    let kind = kind.unwrap_or_else(|_| "an exception".to_owned());
    let what = error.value(py).str().map(|it| it.to_string());
    let first = match what.unwrap_or_default() {
        what if what.is_empty() => format!("the rule raised {kind}"),
        what => format!("the rule raised {kind}: {what}"),
    };
    let trace = error.traceback(py).and_then(|it| it.format().ok());
    match trace {
        Some(trace) => format!("{first}\n{}", trace.trim_end()),
        None => first,
    }
}

fn kind_name(kind: Option<FileKind>) -> &'static str {
    kind.map_or("", |kind| kind.as_str())
}

fn numbers(version: Version) -> (u16, u16) {
    (version.major, version.minor)
}

/// Returns the version in the header of a document of either standard.
pub(crate) fn version_of(document: &Document<'_>) -> Option<Version> {
    let root = document.root()?;
    let header = match root.name() {
        "OpenSCENARIO" => "FileHeader",
        _ => "header",
    };
    qcbus_sdk::basic::version_of(document, header)
}

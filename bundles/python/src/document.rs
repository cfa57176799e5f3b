//! The document that a rule looks at.

use std::sync::Arc;

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use qcbus_messages::DocumentRole;

use crate::column::Table;
use crate::element::{Element, Elements, indexes, names};
use crate::lease::Lease;
use crate::roads::{self, Road};
use crate::rows::Rows;

/// A document, read in place and valid until the rule's job is over.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Document {
    pub(crate) lease: Arc<Lease>,
    /// `None` for the root; else what it is to it.
    role: Option<DocumentRole>,
    kind: &'static str,
    version: Option<(u16, u16)>,
    linked: Vec<Py<Document>>,
}

impl Document {
    pub(crate) fn new(
        lease: Arc<Lease>,
        role: Option<DocumentRole>,
        kind: &'static str,
        version: Option<(u16, u16)>,
        linked: Vec<Py<Document>>,
    ) -> Document {
        Document {
            lease,
            role,
            kind,
            version,
            linked,
        }
    }

    fn evaluate(&self, path: &str) -> PyResult<Vec<u32>> {
        self.lease
            .read(|document| match document.root() {
                // As lxml's trees do: a path without a leading `/` begins at the root element.
                Some(root) => indexes(root.evaluate(path)),
                None => Ok(Vec::new()),
            })?
            .map_err(PyValueError::new_err)
    }

    fn element(&self, index: u32) -> Element {
        Element::new(&self.lease, index)
    }
}

#[pymethods]
impl Document {
    /// The root element; `None` when the file has none.
    #[getter]
    fn root(&self) -> PyResult<Option<Element>> {
        let has_root = self.lease.read(|document| document.root().is_some())?;
        Ok(has_root.then(|| self.element(0)))
    }

    /// As `root`, under the name that lxml has for it.
    fn getroot(&self) -> PyResult<Option<Element>> {
        self.root()
    }

    /// All elements in document order; with names, those that bear one of them.
    #[pyo3(signature = (*tags))]
    fn iter(&self, tags: &Bound<'_, PyTuple>) -> PyResult<Elements> {
        let end = self.lease.read(|document| document.len())?;
        Elements::within(&self.lease, 0..end, &names(tags)?)
    }

    /// The first element that a path leads to from the root, or `None`.
    fn find(&self, path: &str) -> PyResult<Option<Element>> {
        let found = self.evaluate(path)?.first().copied();
        Ok(found.map(|index| self.element(index)))
    }

    /// All elements that a path leads to from the root, in document order.
    fn findall(&self, path: &str) -> PyResult<Vec<Element>> {
        let found = self.evaluate(path)?.into_iter();
        Ok(found.map(|index| self.element(index)).collect())
    }

    /// All elements that an XPath leads to: as `findall`.
    fn xpath(&self, path: &str) -> PyResult<Vec<Element>> {
        self.findall(path)
    }

    /// How many elements bear a name.
    fn count(&self, tag: &str) -> PyResult<usize> {
        self.lease.read(|document| document.elements(tag).count())
    }

    /// All elements of a name as a table with a row for each, and a column of floats for each attribute that is named:
    /// `doc.table("geometry", "s", "length")["s"]`. Not-a-number stands for what is missing or no finite number.
    #[pyo3(signature = (tag, *attributes))]
    fn table(&self, py: Python<'_>, tag: &str, attributes: Vec<String>) -> PyResult<Rows> {
        Rows::of(py, &self.lease, tag, attributes)
    }

    /// The roads of an OpenDRIVE map in document order.
    #[getter]
    fn roads(&self) -> PyResult<Vec<Road>> {
        roads::roads(&self.lease)
    }

    /// The road of an id, or `None`.
    fn road(&self, id: &str) -> PyResult<Option<Road>> {
        roads::road(&self.lease, id)
    }

    /// Poses of all reference lines, every `step` metres and at the end of each road: a table with the columns `road`
    /// (its number in `roads`), `s`, `x`, `y`, `hdg` and `curvature`. Where a pose cannot be evaluated it is
    /// not-a-number.
    fn poses(&self, py: Python<'_>, step: f64) -> PyResult<Table> {
        roads::poses(py, &self.lease, step)
    }

    /// Widths of all lanes but the center, every `step` metres and at the end of each road: a table with the columns
    /// `road` (its number in `roads`), `s`, `lane` (its id) and `width`.
    fn widths(&self, py: Python<'_>, step: f64) -> PyResult<Table> {
        roads::widths(py, &self.lease, step)
    }

    /// The absolute path of its file. To be shown, not to be opened: a bundle sees documents, not files.
    #[getter]
    fn path(&self) -> &str {
        self.lease.path()
    }

    /// What its file is: `xodr`, `xosc`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.kind
    }

    /// The version of the standard that it names as two numbers, or `None`.
    #[getter]
    fn version(&self) -> Option<(u16, u16)> {
        self.version
    }

    /// What it is to the root: `map`, `catalog`, `scenario`; `None` for the root itself.
    #[getter]
    fn role(&self) -> Option<&'static str> {
        self.role.map(role_name)
    }

    /// The documents that the root refers to, in the order of the references.
    #[getter]
    fn linked(&self, py: Python<'_>) -> Vec<Py<Document>> {
        self.linked.iter().map(|it| it.clone_ref(py)).collect()
    }

    /// The map that a scenario refers to, or `None` when there is none at hand.
    #[getter]
    fn map(&self, py: Python<'_>) -> Option<Py<Document>> {
        let is_map = |it: &&Py<Document>| it.get().role == Some(DocumentRole::Map);
        self.linked.iter().find(is_map).map(|it| it.clone_ref(py))
    }

    /// Whether the elements are the whole file: no fault of its text hides a part. Of the root that is so: where it is
    /// not, no rule is asked.
    #[getter]
    fn is_well_formed(&self) -> PyResult<bool> {
        self.lease.read(|document| document.is_well_formed())
    }

    fn __repr__(&self) -> String {
        format!("<document {}>", self.lease.path())
    }
}

fn role_name(role: DocumentRole) -> &'static str {
    match role {
        DocumentRole::Root => "root",
        DocumentRole::Map => "map",
        DocumentRole::Catalog => "catalog",
        _ => "scenario",
    }
}

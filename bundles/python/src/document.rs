//! The document that a rule checks.

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

/// A document that is read in place. It is valid until the rule's job has ended.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Document {
    pub(crate) lease: Arc<Lease>,
    /// Role in relation to the root, or `None` for the root itself.
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
                // As in lxml's trees, a path without a leading `/` begins at the root element.
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
    /// Returns the root element, or `None` if the file has none.
    #[getter]
    fn root(&self) -> PyResult<Option<Element>> {
        let has_root = self.lease.read(|document| document.root().is_some())?;
        Ok(has_root.then(|| self.element(0)))
    }

    /// Returns the same as `root`, under the name used by lxml.
    fn getroot(&self) -> PyResult<Option<Element>> {
        self.root()
    }

    /// Returns all elements in document order. Names restrict the result to these names.
    #[pyo3(signature = (*tags))]
    fn iter(&self, tags: &Bound<'_, PyTuple>) -> PyResult<Elements> {
        let end = self.lease.read(|document| document.len())?;
        Elements::within(&self.lease, 0..end, &names(tags)?)
    }

    /// Returns the first element that a path selects from the root, or `None`.
    fn find(&self, path: &str) -> PyResult<Option<Element>> {
        let found = self.evaluate(path)?.first().copied();
        Ok(found.map(|index| self.element(index)))
    }

    /// Returns all elements that a path selects from the root, in document order.
    fn findall(&self, path: &str) -> PyResult<Vec<Element>> {
        let found = self.evaluate(path)?.into_iter();
        Ok(found.map(|index| self.element(index)).collect())
    }

    /// Returns all elements that an XPath selects, as `findall` does.
    fn xpath(&self, path: &str) -> PyResult<Vec<Element>> {
        self.findall(path)
    }

    /// Returns the number of elements with a name.
    fn count(&self, tag: &str) -> PyResult<usize> {
        self.lease.read(|document| document.elements(tag).count())
    }

    /// Returns a table with one row for each element of a name, and one column of floats for each
    /// given attribute: `doc.table("geometry", "s", "length")["s"]`. A value that is missing or not
    /// a finite number is not-a-number.
    #[pyo3(signature = (tag, *attributes))]
    fn table(&self, py: Python<'_>, tag: &str, attributes: Vec<String>) -> PyResult<Rows> {
        Rows::of(py, &self.lease, tag, attributes)
    }

    /// Returns the roads of an OpenDRIVE map in document order.
    #[getter]
    fn roads(&self) -> PyResult<Vec<Road>> {
        roads::roads(&self.lease)
    }

    /// Returns the road with an id, or `None`.
    fn road(&self, id: &str) -> PyResult<Option<Road>> {
        roads::road(&self.lease, id)
    }

    /// Returns the poses of all reference lines, every `step` metres and at the end of each road.
    /// The table has the columns `road` (index in `roads`), `s`, `x`, `y`, `hdg` and `curvature`. A
    /// pose that cannot be evaluated is not-a-number.
    fn poses(&self, py: Python<'_>, step: f64) -> PyResult<Table> {
        roads::poses(py, &self.lease, step)
    }

    /// Returns the widths of all lanes except center lanes, every `step` metres and at each road's
    /// end. The table has the columns `road` (index in `roads`), `s`, `lane` (its id) and `width`.
    fn widths(&self, py: Python<'_>, step: f64) -> PyResult<Table> {
        roads::widths(py, &self.lease, step)
    }

    /// Returns the absolute path of its file, for display only: a bundle reads documents, not
    /// files.
    #[getter]
    fn path(&self) -> &str {
        self.lease.path()
    }

    /// Returns the kind of its file: `xodr`, `xosc`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.kind
    }

    /// Returns the version of the standard in the header as two numbers, or `None`.
    #[getter]
    fn version(&self) -> Option<(u16, u16)> {
        self.version
    }

    /// Returns its role for the root: `map`, `catalog`, `scenario`; `None` for the root itself.
    #[getter]
    fn role(&self) -> Option<&'static str> {
        self.role.map(role_name)
    }

    /// Returns the documents that the root refers to, in the order of the references.
    #[getter]
    fn linked(&self, py: Python<'_>) -> Vec<Py<Document>> {
        self.linked.iter().map(|it| it.clone_ref(py)).collect()
    }

    /// Returns the map that a scenario refers to, or `None` if it is not available.
    #[getter]
    fn map(&self, py: Python<'_>) -> Option<Py<Document>> {
        let is_map = |it: &&Py<Document>| it.get().role == Some(DocumentRole::Map);
        self.linked.iter().find(is_map).map(|it| it.clone_ref(py))
    }

    /// Checks whether the file is read completely: no fault of its text hides a part. This is
    /// always true for the root, because rules are not called for a broken root.
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

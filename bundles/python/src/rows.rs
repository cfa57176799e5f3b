//! All elements of one name, with some of their attributes as columns.

use std::sync::Arc;

use pyo3::exceptions::{PyIndexError, PyKeyError};
use pyo3::prelude::*;
use qcbus_document::{Document, Node};

use crate::column::Column;
use crate::element::Element;
use crate::lease::Lease;

/// The elements of one name in document order, one row for each, with columns of numbers from their
/// attributes. The columns outlive the job, but the elements do not.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Rows {
    lease: Arc<Lease>,
    indexes: Vec<u32>,
    columns: Vec<(String, Py<Column>)>,
}

impl Rows {
    pub(crate) fn of(
        py: Python<'_>,
        lease: &Arc<Lease>,
        tag: &str,
        attributes: Vec<String>,
    ) -> PyResult<Rows> {
        let (indexes, values) = lease.read(|document| {
            let indexes = document.elements(tag).map(|node| node.index()).collect();
            let of = |attribute: &String| numbers(document, tag, attribute);
            (indexes, attributes.iter().map(of).collect::<Vec<_>>())
        })?;
        let columns = attributes
            .into_iter()
            .zip(values)
            .map(|(name, values)| Ok((name, Py::new(py, Column::floats(values))?)));
        Ok(Rows {
            lease: lease.clone(),
            indexes,
            columns: columns.collect::<PyResult<_>>()?,
        })
    }

    fn position(&self, index: u32) -> Option<i64> {
        let found = self.indexes.binary_search(&index).ok()?;
        i64::try_from(found).ok()
    }
}

/// Returns an attribute's values. Missing, malformed and infinite ones are not-a-number.
fn numbers(document: &Document<'_>, tag: &str, attribute: &str) -> Vec<f64> {
    let number = |node: Node<'_>| {
        let value = node.attribute(attribute)?.f64().ok()?;
        value.is_finite().then_some(value)
    };
    let all = document.elements(tag);
    all.map(|node| number(node).unwrap_or(f64::NAN)).collect()
}

#[pymethods]
impl Rows {
    fn __len__(&self) -> usize {
        self.indexes.len()
    }

    /// Returns the column of an attribute for a text, or the element of a row for a number.
    fn __getitem__(&self, py: Python<'_>, which: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        if let Ok(name) = which.extract::<&str>() {
            let column = self.columns.iter().find(|(known, _)| known == name);
            return match column {
                Some((_, column)) => Ok(column.clone_ref(py).into_any()),
                None => Err(PyKeyError::new_err(format!(
                    "column `{name}` was not requested"
                ))),
            };
        }
        // This also accepts NumPy's integers.
        let number = which.call_method0("__index__")?.extract::<isize>()?;
        let at = match usize::try_from(number) {
            Ok(number) => Some(number),
            Err(_) => self.indexes.len().checked_sub(number.unsigned_abs()),
        };
        let index = at.and_then(|at| self.indexes.get(at));
        let index = index.ok_or_else(|| PyIndexError::new_err("no such row"))?;
        Ok(Py::new(py, Element::new(&self.lease, *index))?.into_any())
    }

    /// Returns for each row the row number of the innermost enclosing element in `other`, or -1 if
    /// there is none.
    fn within(&self, other: &Rows) -> PyResult<Column> {
        let rows = self.lease.read(|document| {
            let outer = |index: &u32| {
                let node = document.node(*index)?;
                node.ancestors().find_map(|it| other.position(it.index()))
            };
            let all = self.indexes.iter();
            all.map(|index| outer(index).unwrap_or(-1)).collect()
        })?;
        Ok(Column::ints(rows))
    }

    /// Returns the names of its columns.
    fn keys(&self) -> Vec<String> {
        self.columns.iter().map(|(name, _)| name.clone()).collect()
    }

    fn __repr__(&self) -> String {
        format!("<{} rows: {}>", self.indexes.len(), self.keys().join(", "))
    }
}

//! Number columns as Python buffers.

use std::ffi::{CStr, c_int, c_void};

use pyo3::exceptions::{PyBufferError, PyIndexError, PyKeyError};
use pyo3::prelude::*;
use pyo3::{IntoPyObjectExt as _, ffi};

/// A contiguous column of numbers of one type. `memoryview`, NumPy and other users of Python's
/// buffer protocol read it without a copy. The numbers were computed for the caller and outlive the
/// job.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Column {
    values: Values,
    /// Number of values. The buffer protocol needs a pointer to it.
    shape: ffi::Py_ssize_t,
    stride: ffi::Py_ssize_t,
}

enum Values {
    Floats(Vec<f64>),
    Ints(Vec<i64>),
}

impl Column {
    /// Creates a column of doubles. Missing values are not-a-number.
    pub(crate) fn floats(values: Vec<f64>) -> Column {
        Column::of(values.len(), Values::Floats(values))
    }

    /// Creates a column of integers.
    pub(crate) fn ints(values: Vec<i64>) -> Column {
        Column::of(values.len(), Values::Ints(values))
    }

    fn of(len: usize, values: Values) -> Column {
        Column {
            values,
            // A vector has at most `isize::MAX` bytes.
            shape: ffi::Py_ssize_t::try_from(len).unwrap_or(ffi::Py_ssize_t::MAX),
            stride: 8,
        }
    }

    fn len(&self) -> usize {
        match &self.values {
            Values::Floats(values) => values.len(),
            Values::Ints(values) => values.len(),
        }
    }

    fn value(&self, py: Python<'_>, at: usize) -> Option<PyResult<Py<PyAny>>> {
        match &self.values {
            Values::Floats(values) => values.get(at).map(|value| value.into_py_any(py)),
            Values::Ints(values) => values.get(at).map(|value| value.into_py_any(py)),
        }
    }
}

#[pymethods]
impl Column {
    fn __len__(&self) -> usize {
        self.len()
    }

    fn __getitem__(&self, py: Python<'_>, number: isize) -> PyResult<Py<PyAny>> {
        let at = match usize::try_from(number) {
            Ok(number) => Some(number),
            Err(_) => self.len().checked_sub(number.unsigned_abs()),
        };
        let value = at.and_then(|at| self.value(py, at));
        value.unwrap_or_else(|| Err(PyIndexError::new_err("no such row")))
    }

    /// Returns the type of its numbers in the notation of `array` and `memoryview`: `d` for floats,
    /// `q` for integers.
    #[getter]
    fn format(&self) -> &'static str {
        match &self.values {
            Values::Floats(_) => "d",
            Values::Ints(_) => "q",
        }
    }

    /// Returns a NumPy array over the same memory. Needs NumPy.
    fn numpy<'py>(slf: Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("numpy")?.call_method1("asarray", (slf,))
    }

    fn __repr__(&self) -> String {
        format!("<column of {} `{}`>", self.len(), self.format())
    }

    #[expect(unsafe_code, reason = "the buffer protocol is a C interface")]
    unsafe fn __getbuffer__(
        slf: Bound<'_, Self>,
        view: *mut ffi::Py_buffer,
        flags: c_int,
    ) -> PyResult<()> {
        if view.is_null() {
            return Err(PyBufferError::new_err("the buffer view is null"));
        }
        let wants = |flag: c_int| flags & flag == flag;
        let column = slf.get();
        let (data, format): (*const c_void, &'static CStr) = match &column.values {
            Values::Floats(values) => (values.as_ptr().cast(), c"d"),
            Values::Ints(values) => (values.as_ptr().cast(), c"q"),
        };
        let (shape, stride) = (&raw const column.shape, &raw const column.stride);
        let refused = wants(ffi::PyBUF_WRITABLE);
        // SAFETY: `view` points at a buffer to be filled in, as the interpreter promises. The
        // fields point into the column. The column is frozen (so nothing moves), and `obj` keeps it
        // alive until the buffer is released.
        unsafe {
            (*view).obj = std::ptr::null_mut();
            if refused {
                return Err(PyBufferError::new_err("a column is read-only"));
            }
            (*view).buf = data.cast_mut();
            (*view).len = column.shape * column.stride;
            (*view).itemsize = column.stride;
            (*view).readonly = 1;
            (*view).ndim = 1;
            (*view).format = match wants(ffi::PyBUF_FORMAT) {
                true => format.as_ptr().cast_mut(),
                false => std::ptr::null_mut(),
            };
            (*view).shape = match wants(ffi::PyBUF_ND) {
                true => shape.cast_mut(),
                false => std::ptr::null_mut(),
            };
            (*view).strides = match wants(ffi::PyBUF_STRIDES) {
                true => stride.cast_mut(),
                false => std::ptr::null_mut(),
            };
            (*view).suboffsets = std::ptr::null_mut();
            (*view).internal = std::ptr::null_mut();
            (*view).obj = slf.into_any().into_ptr();
        }
        Ok(())
    }
}

/// Named columns of the same length.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Table {
    columns: Vec<(String, Py<Column>)>,
    rows: usize,
}

impl Table {
    pub(crate) fn new(py: Python<'_>, columns: Vec<(&str, Column)>) -> PyResult<Table> {
        let rows = columns.first().map_or(0, |(_, column)| column.len());
        let named = columns
            .into_iter()
            .map(|(name, column)| Ok((name.to_owned(), Py::new(py, column)?)));
        Ok(Table {
            columns: named.collect::<PyResult<_>>()?,
            rows,
        })
    }
}

#[pymethods]
impl Table {
    /// Returns the number of rows.
    fn __len__(&self) -> usize {
        self.rows
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<Py<Column>> {
        let column = self.columns.iter().find(|(known, _)| known == name);
        match column {
            Some((_, column)) => Ok(column.clone_ref(py)),
            None => Err(PyKeyError::new_err(format!(
                "no column `{name}`; the columns are {}",
                self.keys().join(", ")
            ))),
        }
    }

    fn __contains__(&self, name: &str) -> bool {
        self.columns.iter().any(|(known, _)| known == name)
    }

    /// Returns the names of its columns.
    fn keys(&self) -> Vec<String> {
        self.columns.iter().map(|(name, _)| name.clone()).collect()
    }

    fn __repr__(&self) -> String {
        format!("<table of {} rows: {}>", self.rows, self.keys().join(", "))
    }
}

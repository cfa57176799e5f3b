//! Access to a document for the duration of its job.

use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyString;
use qcbus_document::{Document, Image, ImageError};
use qcbus_opendrive::OwnedMap;
use self_cell::self_cell;

self_cell!(
    struct Opened {
        owner: Image,

        #[covariant]
        dependent: Document,
    }
);

pyo3::create_exception!(
    qcbus,
    Closed,
    PyRuntimeError,
    "The job that this belonged to has ended, and its document is no longer available."
);

/// Short-lived access to an open document.
pub(crate) struct Glance(Arc<Opened>);

impl Glance {
    pub(crate) fn document(&self) -> &Document<'_> {
        self.0.borrow_dependent()
    }
}

/// A document that Python objects read. It is closed at the end of the job. Elements that a script
/// still holds then raise an error, and the shared memory is released.
pub(crate) struct Lease {
    opened: Mutex<Option<Arc<Opened>>>,
    /// Road model, created on first use.
    map: Mutex<Option<Arc<OwnedMap>>>,
    /// Distinct names of the document as Python strings, indexed by name number.
    names: Vec<Py<PyString>>,
    path: String,
}

impl Lease {
    pub(crate) fn open(py: Python<'_>, image: &Image) -> Result<Arc<Lease>, ImageError> {
        let opened = Opened::try_new(image.clone(), |image| image.document())?;
        let document = opened.borrow_dependent();
        let intern = |name: &str| PyString::intern(py, name).unbind();
        Ok(Arc::new(Lease {
            names: document.names().map(intern).collect(),
            path: document.path().to_owned(),
            opened: Mutex::new(Some(Arc::new(opened))),
            map: Mutex::default(),
        }))
    }

    /// Calls `look` with the document. `look` must not run Python code, because that would keep the
    /// document open.
    ///
    /// # Errors
    /// [`Closed`].
    pub(crate) fn read<T>(&self, look: impl FnOnce(&Document<'_>) -> T) -> PyResult<T> {
        self.hold().map(|held| look(held.document()))
    }

    /// Holds the document open for a short time.
    ///
    /// # Errors
    /// [`Closed`].
    pub(crate) fn hold(&self) -> PyResult<Glance> {
        let slot = self.opened.lock().unwrap_or_else(PoisonError::into_inner);
        slot.clone().map(Glance).ok_or_else(|| {
            Closed::new_err(
                "the job that this belonged to has ended: a rule may keep texts and numbers, but no elements",
            )
        })
    }

    /// Returns the road model. It is created on first use.
    ///
    /// # Errors
    /// [`Closed`].
    pub(crate) fn map(&self) -> PyResult<Arc<OwnedMap>> {
        let held = self.hold()?;
        let mut map = self.map.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(map) = &*map {
            return Ok(map.clone());
        }
        let image = held.0.borrow_owner().clone();
        let made =
            OwnedMap::of(image).map_err(|error| PyRuntimeError::new_err(error.to_string()))?;
        Ok(map.insert(Arc::new(made)).clone())
    }

    /// Closes the document at the end of the job.
    pub(crate) fn close(&self) {
        let opened = self
            .opened
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        let map = self
            .map
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        drop((map, opened));
    }

    /// Returns a distinct name by its number. All elements with this name share one string.
    pub(crate) fn name<'py>(&self, py: Python<'py>, number: u16) -> Bound<'py, PyString> {
        match self.names.get(usize::from(number)) {
            Some(name) => name.bind(py).clone(),
            None => PyString::new(py, ""),
        }
    }

    pub(crate) fn path(&self) -> &str {
        &self.path
    }
}

//! Findings of a rule: collected while it runs, and passed to the SDK after it returns.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::{PyKeyError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use qcbus_document::{Document, Node};
use qcbus_sdk::{Level, Place, Sink};

use crate::bundle::level_of;
use crate::document;
use crate::element::Element;
use crate::lease::{Closed, Lease};
use crate::roads::{PyLane, Road, Section};

/// Maximum number of findings that are stored with their texts. Further ones are only counted by
/// level. A result lists fewer findings than this.
const MOST: usize = 100_000;

/// Place of a finding.
#[derive(Clone)]
struct Spot {
    lease: Arc<Lease>,
    index: u32,
    attribute: Option<String>,
}

/// Description of one place.
struct Mark {
    spot: Spot,
    /// Text of the place. It is empty for the first place, unless it is set explicitly.
    description: String,
    point: Option<(f64, f64, f64)>,
    road: Option<(String, f64, f64)>,
}

struct Entry {
    marks: Vec<Mark>,
    text: String,
    level: Option<Level>,
    uid: Option<String>,
}

/// State shared by a rule and its findings.
struct Told {
    collected: Mutex<Collected>,
    /// The documents of the job.
    leases: Vec<Arc<Lease>>,
}

#[derive(Default)]
struct Collected {
    entries: Vec<Entry>,
    /// Facts about the check: key, value and description.
    facts: Vec<(String, String, String)>,
    over: bool,
}

/// Collector for the findings of a rule.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Found {
    told: Arc<Told>,
    uids: Vec<String>,
    params: Py<PyDict>,
    version: Option<(u16, u16)>,
}

/// One finding. More details can be added to it.
#[pyclass(frozen, module = "qcbus", name = "Finding")]
pub(crate) struct PyFinding {
    told: Arc<Told>,
    number: usize,
}

impl Told {
    fn lock(&self) -> MutexGuard<'_, Collected> {
        self.collected
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    fn open(&self) -> PyResult<MutexGuard<'_, Collected>> {
        let collected = self.lock();
        match collected.over {
            true => Err(Closed::new_err(
                "the rule has already returned: anything that it reports afterwards is lost",
            )),
            false => Ok(collected),
        }
    }

    /// Returns the place of an element. A document stands for its root. Places of another job are
    /// rejected, because the finding would be lost.
    fn spot(&self, at: &Bound<'_, PyAny>, attribute: Option<String>) -> PyResult<Spot> {
        let Element { lease, index } = element_of(at)?;
        lease.hold()?;
        if !self.leases.iter().any(|own| Arc::ptr_eq(own, &lease)) {
            let text =
                "a finding must point at an element or a document of its own job, not of another";
            return Err(PyValueError::new_err(text));
        }
        Ok(Spot {
            lease,
            index,
            attribute,
        })
    }
}

/// Returns the element for a place that a rule names.
fn element_of(at: &Bound<'_, PyAny>) -> PyResult<Element> {
    if let Ok(element) = at.cast::<Element>() {
        let Element { lease, index } = element.get();
        return Ok(Element::new(lease, *index));
    }
    if let Ok(document) = at.cast::<document::Document>() {
        return Ok(Element::new(&document.get().lease, 0));
    }
    if let Ok(road) = at.cast::<Road>() {
        return road.get().element();
    }
    if let Ok(section) = at.cast::<Section>() {
        return section.get().element();
    }
    if let Ok(lane) = at.cast::<PyLane>() {
        return lane.get().element();
    }
    let what = at.get_type().name()?;
    Err(PyTypeError::new_err(format!(
        "a finding must point at an element, a road, a lane section, a lane or a document of its job, not at \
         {what}"
    )))
}

impl Found {
    pub(crate) fn new(
        uids: &[&str],
        params: Bound<'_, PyDict>,
        version: Option<(u16, u16)>,
        leases: &[Arc<Lease>],
    ) -> Found {
        Found {
            told: Arc::new(Told {
                collected: Mutex::default(),
                leases: leases.to_vec(),
            }),
            uids: uids.iter().map(|uid| (*uid).to_owned()).collect(),
            params: params.unbind(),
            version,
        }
    }

    /// Passes the findings to the SDK. `document_of` returns the document of a lease. Later
    /// findings are rejected.
    pub(crate) fn tell<'d>(
        &self,
        sink: &mut Sink<'d>,
        document_of: impl Fn(&Arc<Lease>) -> Option<Document<'d>>,
    ) {
        let collected = {
            let mut collected = self.told.lock();
            std::mem::replace(
                &mut *collected,
                Collected {
                    over: true,
                    ..Collected::default()
                },
            )
        };
        for entry in &collected.entries {
            tell(entry, sink, &document_of);
        }
        for (key, value, description) in &collected.facts {
            sink.fact(key, value.as_str(), description);
        }
    }
}

fn tell<'d>(
    entry: &Entry,
    sink: &mut Sink<'d>,
    document_of: &impl Fn(&Arc<Lease>) -> Option<Document<'d>>,
) {
    let place = |spot: &Spot| -> Option<Place<'d>> {
        let document = document_of(&spot.lease)?;
        let node: Option<Node<'d>> = document.node(spot.index);
        Some(match (node, &spot.attribute) {
            (Some(node), Some(attribute)) => Place::attribute_or_node(node, attribute),
            (Some(node), None) => Place::Node(node),
            // The document has no elements.
            (None, _) => Place::Text(document, 0),
        })
    };
    let mut marks = entry.marks.iter();
    let Some(first) = marks.next() else { return };
    let Some(at) = place(&first.spot) else { return };
    let mut finding = sink.issue(at, entry.text.as_str());
    if let Some(level) = entry.level {
        finding = finding.level(level);
    }
    if let Some(uid) = &entry.uid {
        finding = finding.uid(uid);
    }
    if !first.description.is_empty() {
        finding = finding.here(&first.description);
    }
    finding = positions(first, finding);
    for mark in marks {
        if let Some(at) = place(&mark.spot) {
            finding = positions(mark, finding.at(at, &mark.description));
        }
    }
}

fn positions<'s, 'd>(
    mark: &Mark,
    mut finding: qcbus_sdk::Finding<'s, 'd>,
) -> qcbus_sdk::Finding<'s, 'd> {
    if let Some((x, y, z)) = mark.point {
        finding = finding.point(x, y, z);
    }
    if let Some((id, s, t)) = &mark.road {
        finding = finding.road(id, *s, *t);
    }
    finding
}

#[pymethods]
impl Found {
    /// Reports an issue of an element or one of its attributes. The text names what was found, what
    /// is allowed, and what to do.
    #[pyo3(signature = (at, text, *, attribute=None, level=None, uid=None))]
    fn issue(
        &self,
        at: &Bound<'_, PyAny>,
        text: String,
        attribute: Option<String>,
        level: Option<&str>,
        uid: Option<String>,
    ) -> PyResult<PyFinding> {
        let spot = self.told.spot(at, attribute)?;
        let level = level.map(level_of).transpose()?;
        if let Some(uid) = uid.as_ref().filter(|uid| !self.uids.contains(uid)) {
            let own = self.uids.join("`, `");
            let text = format!("`{uid}` is not a UID of this rule; its UIDs are `{own}`");
            return Err(PyValueError::new_err(text));
        }
        let mut collected = self.told.open()?;
        let is_listed = collected.entries.len() < MOST;
        let mark = Mark {
            spot,
            description: String::new(),
            point: None,
            road: None,
        };
        collected.entries.push(Entry {
            marks: vec![mark],
            text: if is_listed { text } else { String::new() },
            level,
            uid,
        });
        Ok(PyFinding {
            told: self.told.clone(),
            number: collected.entries.len() - 1,
        })
    }

    /// Adds a fact about the check itself, for example the reference used for the document.
    #[pyo3(signature = (key, value, description=""))]
    fn fact(&self, key: String, value: &Bound<'_, PyAny>, description: &str) -> PyResult<()> {
        let value = value.str()?.to_string();
        let mut collected = self.told.open()?;
        collected.facts.push((key, value, description.to_owned()));
        Ok(())
    }

    /// Returns the value of a parameter of the rule.
    fn param<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let value = self.params.bind(py).get_item(name)?;
        value.ok_or_else(|| PyKeyError::new_err(format!("the rule declares no parameter `{name}`")))
    }

    /// Returns all parameters of the rule with their values.
    #[getter]
    fn params<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        self.params.bind(py).copy()
    }

    /// Returns the version of the standard in the document's header as two numbers, or `None`.
    #[getter]
    fn version(&self) -> Option<(u16, u16)> {
        self.version
    }

    fn __len__(&self) -> usize {
        self.told.lock().entries.len()
    }

    /// Returns `true`, even if there are no findings.
    fn __bool__(&self) -> bool {
        true
    }
}

impl PyFinding {
    fn change(&self, change: impl FnOnce(&mut Entry)) -> PyResult<()> {
        let mut collected = self.told.open()?;
        if let Some(entry) = collected.entries.get_mut(self.number) {
            change(entry);
        }
        Ok(())
    }

    fn last(&self, change: impl FnOnce(&mut Mark)) -> PyResult<()> {
        self.change(|entry| entry.marks.last_mut().map(change).unwrap_or_default())
    }
}

#[pymethods]
impl PyFinding {
    /// Adds a further place with its description.
    #[pyo3(signature = (place, description, *, attribute=None))]
    fn at<'py>(
        slf: PyRef<'py, Self>,
        place: &Bound<'py, PyAny>,
        description: String,
        attribute: Option<String>,
    ) -> PyResult<PyRef<'py, Self>> {
        let mark = Mark {
            spot: slf.told.spot(place, attribute)?,
            description,
            point: None,
            road: None,
        };
        slf.change(|entry| entry.marks.push(mark))?;
        Ok(slf)
    }

    /// Sets the description of the place itself. It replaces "element `road`".
    fn here<'py>(slf: PyRef<'py, Self>, description: String) -> PyResult<PyRef<'py, Self>> {
        slf.change(|entry| {
            if let Some(first) = entry.marks.first_mut() {
                first.description = description;
            }
        })?;
        Ok(slf)
    }

    /// Adds a point in the inertial coordinate system, in metres, to the last place.
    #[pyo3(signature = (x, y, z=0.0))]
    fn point(slf: PyRef<'_, Self>, x: f64, y: f64, z: f64) -> PyResult<PyRef<'_, Self>> {
        slf.last(|mark| mark.point = Some((x, y, z)))?;
        Ok(slf)
    }

    /// Adds a position on a road, in metres, to the last place.
    #[pyo3(signature = (road_id, s, t=0.0))]
    fn road(slf: PyRef<'_, Self>, road_id: String, s: f64, t: f64) -> PyResult<PyRef<'_, Self>> {
        slf.last(|mark| mark.road = Some((road_id, s, t)))?;
        Ok(slf)
    }

    /// Sets a severity other than the rule's.
    fn level<'py>(slf: PyRef<'py, Self>, level: &str) -> PyResult<PyRef<'py, Self>> {
        let level = level_of(level)?;
        slf.change(|entry| entry.level = Some(level))?;
        Ok(slf)
    }
}

//! Elements with the interface of lxml, read in place.

use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::{Arc, Mutex, PoisonError};

use pyo3::exceptions::{PyIndexError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString, PyTuple};
use qcbus_document::{Document, Node};

use crate::lease::Lease;

/// An element of a document. It is valid until the rule's job has ended.
///
/// It has the interface of lxml's element, but is read-only. Names are local names, without prefix
/// or namespace.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Element {
    pub(crate) lease: Arc<Lease>,
    pub(crate) index: u32,
}

impl Element {
    pub(crate) fn new(lease: &Arc<Lease>, index: u32) -> Element {
        Element {
            lease: lease.clone(),
            index,
        }
    }

    /// Calls `look` with the node.
    fn node<T>(&self, look: impl FnOnce(Node<'_>) -> T) -> PyResult<T> {
        // The index comes from this document, so the node exists.
        let gone = || PyIndexError::new_err("no such element");
        self.lease
            .read(|document| document.node(self.index).map(look))?
            .ok_or_else(gone)
    }

    fn other(&self, look: impl FnOnce(Node<'_>) -> Option<Node<'_>>) -> PyResult<Option<Element>> {
        let found = self.node(|node| look(node).map(|node| node.index()))?;
        Ok(found.map(|index| Element::new(&self.lease, index)))
    }

    fn all(&self, indexes: Vec<u32>) -> Vec<Element> {
        let element = |index| Element::new(&self.lease, index);
        indexes.into_iter().map(element).collect()
    }

    fn evaluate(&self, path: &str) -> PyResult<Vec<u32>> {
        self.node(|node| indexes(node.evaluate(path)))?
            .map_err(PyValueError::new_err)
    }
}

/// Returns the indexes of the nodes that an XPath selects.
pub(crate) fn indexes<E: ToString>(found: Result<Vec<Node<'_>>, E>) -> Result<Vec<u32>, String> {
    match found {
        Ok(nodes) => Ok(nodes.iter().map(Node::index).collect()),
        Err(error) => Err(format!("cannot {}", error.to_string())),
    }
}

#[pymethods]
impl Element {
    /// Returns the local name.
    #[getter]
    fn tag<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyString>> {
        let number = self.node(|node| node.name_number())?;
        Ok(self.lease.name(py, number))
    }

    /// Returns an attribute's value with resolved entities, or `default` if it is missing.
    #[pyo3(signature = (name, default=None))]
    fn get<'py>(
        &self,
        py: Python<'py>,
        name: &str,
        default: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Option<Bound<'py, PyAny>>> {
        let opened = self.lease.hold()?;
        let document = opened.document();
        let value = document.node(self.index).and_then(|node| node.attr(name));
        Ok(match value {
            Some(value) => Some(PyString::new(py, value).into_any()),
            None => default,
        })
    }

    /// Returns an attribute as a finite number, or `None` if it is missing or not such a number.
    fn float(&self, name: &str) -> PyResult<Option<f64>> {
        self.node(|node| {
            // The error borrows the name longer than it lives here, so it is converted to an
            // option.
            let value = node.attribute(name)?.f64().ok()?;
            value.is_finite().then_some(value)
        })
    }

    /// Returns an attribute as an integer of at most 64 bits, or `None` if this is impossible.
    fn int(&self, name: &str) -> PyResult<Option<i64>> {
        self.node(|node| node.attribute(name)?.i64().ok())
    }

    /// Returns all attributes in document order, as a new dictionary.
    #[getter]
    fn attrib<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        let opened = self.lease.hold()?;
        let document = opened.document();
        let node = document.node(self.index);
        for attribute in node.iter().flat_map(|node| node.attributes()) {
            let name = self.lease.name(py, attribute.name_number());
            all.set_item(name, attribute.value())?;
        }
        Ok(all)
    }

    /// Returns the names of the attributes in document order.
    fn keys<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyString>>> {
        let numbers: Vec<u16> = self.node(|node| {
            let attributes = node.attributes();
            attributes
                .map(|attribute| attribute.name_number())
                .collect()
        })?;
        let name = |number| self.lease.name(py, number);
        Ok(numbers.into_iter().map(name).collect())
    }

    /// Returns names and values of the attributes in document order.
    fn items(&self) -> PyResult<Vec<(String, String)>> {
        self.node(|node| {
            let attributes = node.attributes();
            let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
            attributes.map(|it| pair(it.name(), it.value())).collect()
        })
    }

    /// Returns the character data directly in it, with CDATA and resolved entities; `None` if it
    /// has none.
    #[getter]
    fn text(&self) -> PyResult<Option<String>> {
        let text = self.node(|node| node.text().into_owned())?;
        Ok(Some(text).filter(|text| !text.is_empty()))
    }

    /// Returns this element and its descendants in document order. Names restrict the result.
    #[pyo3(signature = (*tags))]
    fn iter(&self, tags: &Bound<'_, PyTuple>) -> PyResult<Elements> {
        let end = self.node(|node| node.subtree_end())?;
        Elements::within(&self.lease, self.index..end, &names(tags)?)
    }

    /// Returns the child elements. Names restrict the result to these names.
    #[pyo3(signature = (*tags))]
    fn iterchildren(&self, tags: &Bound<'_, PyTuple>) -> PyResult<Elements> {
        let tags = names(tags)?;
        let wanted = |node: &Node<'_>| tags.is_empty() || tags.iter().any(|tag| node.is(tag));
        let found = self.node(|node| {
            let children = node.children().filter(wanted);
            children.map(|child| child.index()).collect()
        })?;
        Ok(Elements::of(&self.lease, found))
    }

    fn __iter__(&self) -> PyResult<Elements> {
        let found = self.node(|node| node.children().map(|child| child.index()).collect())?;
        Ok(Elements::of(&self.lease, found))
    }

    fn __len__(&self) -> PyResult<usize> {
        self.node(|node| node.children().count())
    }

    /// Returns `true`, even for an element without children.
    fn __bool__(&self) -> bool {
        true
    }

    fn __getitem__(&self, number: isize) -> PyResult<Element> {
        let found = self.node(|node| {
            let number = match usize::try_from(number) {
                Ok(number) => number,
                Err(_) => node.children().count().checked_sub(number.unsigned_abs())?,
            };
            node.children().nth(number).map(|child| child.index())
        })?;
        found
            .map(|index| Element::new(&self.lease, index))
            .ok_or_else(|| PyIndexError::new_err("no such child"))
    }

    /// Returns the first element that a path selects from here, or `None`: `lanes/laneSection`,
    /// `.//signal[@id='5']`.
    fn find(&self, path: &str) -> PyResult<Option<Element>> {
        let found = self.evaluate(path)?.first().copied();
        Ok(found.map(|index| Element::new(&self.lease, index)))
    }

    /// Returns all elements that a path selects from here, in document order.
    fn findall(&self, path: &str) -> PyResult<Vec<Element>> {
        Ok(self.all(self.evaluate(path)?))
    }

    /// Returns the text of the first element that a path selects, or `default` if there is none.
    #[pyo3(signature = (path, default=None))]
    fn findtext(&self, path: &str, default: Option<String>) -> PyResult<Option<String>> {
        match self.find(path)? {
            Some(found) => Ok(Some(found.text()?.unwrap_or_default())),
            None => Ok(default),
        }
    }

    /// Returns all elements that an XPath selects, as `findall`. A leading `/` is the document.
    fn xpath(&self, path: &str) -> PyResult<Vec<Element>> {
        self.findall(path)
    }

    /// Returns the parent element, or `None` for the root.
    fn getparent(&self) -> PyResult<Option<Element>> {
        self.other(|node| node.parent())
    }

    /// Returns the next sibling, or `None`.
    fn getnext(&self) -> PyResult<Option<Element>> {
        self.other(|node| node.next_sibling())
    }

    /// Returns the previous sibling, or `None`.
    fn getprevious(&self) -> PyResult<Option<Element>> {
        self.other(|node| {
            let siblings = node.parent()?.children();
            siblings.take_while(|it| it.index() < node.index()).last()
        })
    }

    /// Returns its ancestors from the parent up to the root.
    fn iterancestors(&self) -> PyResult<Elements> {
        let found = self.node(|node| node.ancestors().map(|it| it.index()).collect())?;
        Ok(Elements::of(&self.lease, found))
    }

    /// Returns the row of its `<` in its file, from 1.
    #[getter]
    fn sourceline(&self) -> PyResult<u32> {
        self.node(|node| node.position().row)
    }

    /// Returns the column of its `<` in its file in characters, from 1.
    #[getter]
    fn sourcecolumn(&self) -> PyResult<u32> {
        self.node(|node| node.position().column)
    }

    /// Returns the file that contains it: the document's file or an included file.
    #[getter]
    fn sourcefile(&self) -> PyResult<String> {
        self.node(|node| node.position().path.to_owned())
    }

    /// Returns the XPath that is used in findings: `/OpenDRIVE/road[@id='5']/lanes`.
    fn getpath(&self) -> PyResult<String> {
        self.node(|node| node.xpath())
    }

    fn __getattr__(&self, name: &str) -> PyResult<Py<PyAny>> {
        let why = match name {
            "tail" => "character data between elements is not kept",
            "nsmap" | "prefix" => "elements have only local names; namespaces are not available",
            "set" | "append" | "remove" | "insert" | "clear" => {
                "a document is read in place and cannot be changed"
            }
            _ => "there is no such attribute",
        };
        let text = format!("an element has no `{name}`: {why}");
        Err(pyo3::exceptions::PyAttributeError::new_err(text))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Element>().is_ok_and(|other| {
            let other = other.get();
            Arc::ptr_eq(&self.lease, &other.lease) && self.index == other.index
        })
    }

    fn __hash__(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        (Arc::as_ptr(&self.lease).addr(), self.index).hash(&mut hasher);
        hasher.finish()
    }

    fn __repr__(&self) -> PyResult<String> {
        self.node(|node| {
            let id = ["id", "name"]
                .iter()
                .find_map(|key| Some((key, node.attr(key)?)));
            let id = id
                .map(|(key, value)| format!(" {key}={value:?}"))
                .unwrap_or_default();
            format!("<{}{id} at row {}>", node.name(), node.position().row)
        })
    }
}

/// Returns the names from a tuple of names. The result is empty if all names are accepted.
pub(crate) fn names(tags: &Bound<'_, PyTuple>) -> PyResult<Vec<String>> {
    let all: Vec<Option<String>> = tags.extract()?;
    // As in lxml, `None` and `*` select every element.
    let every = |tag: &Option<String>| tag.as_deref().is_none_or(|tag| tag == "*");
    Ok(match all.iter().any(every) {
        true => Vec::new(),
        false => all.into_iter().flatten().collect(),
    })
}

/// Iterator over elements.
#[pyclass(frozen, module = "qcbus")]
pub(crate) struct Elements {
    lease: Arc<Lease>,
    state: Mutex<Pending>,
}

/// State of an iteration.
struct Pending {
    ready: VecDeque<u32>,
    /// Nodes that are not examined yet.
    rest: std::ops::Range<u32>,
    names: Vec<String>,
}

/// Number of elements that are searched in one step.
const AT_ONCE: usize = 1024;

impl Elements {
    pub(crate) fn of(lease: &Arc<Lease>, found: VecDeque<u32>) -> Elements {
        Elements {
            lease: lease.clone(),
            state: Mutex::new(Pending {
                ready: found,
                rest: 0..0,
                names: Vec::new(),
            }),
        }
    }

    /// Returns the elements with one of these names in a subtree, in document order. Without names
    /// it returns all elements.
    pub(crate) fn within(
        lease: &Arc<Lease>,
        rest: std::ops::Range<u32>,
        names: &[String],
    ) -> PyResult<Elements> {
        let elements = Elements::of(lease, VecDeque::new());
        if let [name] = names {
            // The name index finds these elements without a visit of all others.
            let found = lease.read(|document| {
                let outer = document.node(rest.start).into_iter();
                let own = outer.clone().filter(|node| node.is(name));
                let inner = outer.flat_map(|node| node.descendants_named(name));
                own.chain(inner).map(|node| node.index()).collect()
            })?;
            return Ok(Elements::of(lease, found));
        }
        {
            let mut state = elements
                .state
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            (state.rest, state.names) = (rest, names.to_vec());
        }
        Ok(elements)
    }
}

impl Pending {
    fn look_for_more(&mut self, document: &Document<'_>) {
        while self.ready.len() < AT_ONCE {
            let Some(index) = self.rest.next() else {
                return;
            };
            let Some(node) = document.node(index) else {
                return;
            };
            let wanted = || self.names.is_empty() || self.names.iter().any(|name| node.is(name));
            if node.is_element() && wanted() {
                self.ready.push_back(index);
            }
        }
    }
}

#[pymethods]
impl Elements {
    fn __iter__(slf: PyRef<'_, Self>) -> PyRef<'_, Self> {
        slf
    }

    fn __next__(&self) -> PyResult<Option<Element>> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.ready.is_empty() && !state.rest.is_empty() {
            self.lease.read(|document| state.look_for_more(document))?;
        }
        let next = state.ready.pop_front();
        Ok(next.map(|index| Element::new(&self.lease, index)))
    }
}

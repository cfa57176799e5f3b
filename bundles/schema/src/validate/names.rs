//! Translation of the document's names to the schema's numbers.

use qcbus_document::{Attribute, Document, Node};

use crate::model::Schema;
use crate::names::NameId;

/// Namespace of `xsi:type` and the like.
pub(super) const XSI: &str = "http://www.w3.org/2001/XMLSchema-instance";

/// Meaning of an attribute's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum AttributeName {
    /// A name to look up in the type.
    Plain(NameId),
    /// A namespace declaration.
    Namespace,
    /// A name with a prefix, e.g. `xsi:type`.
    Prefixed,
}

/// Map of the document's names, with one lookup per distinct name.
pub(crate) struct NameMap {
    ids: Vec<NameId>,
    marks: Vec<u8>,
    /// Whether any attribute of the document has a prefix.
    pub(super) prefixed: bool,
}

const PLAIN: u8 = 0;
const NAMESPACE: u8 = 1;
const PREFIXED: u8 = 2;

impl NameMap {
    pub(crate) fn new(document: &Document<'_>, schema: &Schema) -> Self {
        let mut map = Self {
            ids: Vec::new(),
            marks: Vec::new(),
            prefixed: false,
        };
        for name in document.names() {
            map.ids
                .push(schema.names.find(name).unwrap_or(NameId::UNKNOWN));
            map.marks.push(match name {
                "xmlns" => NAMESPACE,
                _ if name.starts_with("xmlns:") => NAMESPACE,
                _ if name.contains(':') => PREFIXED,
                _ => PLAIN,
            });
        }
        map.prefixed = map.marks.contains(&PREFIXED);
        map
    }

    #[inline]
    pub(super) fn element(&self, node: Node<'_>) -> NameId {
        self.id(node.name_number())
    }

    #[inline]
    pub(super) fn attribute(&self, attribute: Attribute<'_>) -> AttributeName {
        let number = attribute.name_number();
        match self.marks.get(usize::from(number)).copied() {
            Some(NAMESPACE) => AttributeName::Namespace,
            Some(PREFIXED) => AttributeName::Prefixed,
            _ => AttributeName::Plain(self.id(number)),
        }
    }

    #[inline]
    fn id(&self, number: u16) -> NameId {
        self.ids
            .get(usize::from(number))
            .copied()
            .unwrap_or(NameId::UNKNOWN)
    }

    pub(crate) fn ids(&self) -> &[NameId] {
        &self.ids
    }
}

//! What the schema of a file's own version says already. It is asked late, for it takes a walk through the
//! document: only files with something odd have anything to ask.

use std::cell::OnceCell;

use qcbus_document::{Attribute, Document, FileKind, Node};
use qcbus_schema::{Typing, version_of};

/// The types of a document by the schema of the version that its header names.
pub(crate) struct OwnSchema<'d> {
    document: Document<'d>,
    typing: OnceCell<Option<Typing>>,
}

impl<'d> OwnSchema<'d> {
    pub fn new(document: Document<'d>) -> OwnSchema<'d> {
        OwnSchema {
            document,
            typing: OnceCell::new(),
        }
    }

    /// Whether it lists the words of an attribute, and so reports others.
    pub fn lists(&self, attribute: Attribute<'_>) -> bool {
        let value = self.typing().and_then(|typing| typing.value(attribute));
        value.is_some_and(|value| value.words().is_some())
    }

    /// Whether it demands an attribute, and so reports that it is missing.
    pub fn demands(&self, node: Node<'_>, attribute: &str) -> bool {
        let typing = self.typing();
        typing.is_some_and(|typing| typing.demands(node, attribute))
    }

    fn typing(&self) -> Option<&Typing> {
        let read = || {
            let version = version_of(&self.document, FileKind::Xodr)?;
            Typing::of(&self.document, FileKind::Xodr, version)
        };
        self.typing.get_or_init(read).as_ref()
    }
}

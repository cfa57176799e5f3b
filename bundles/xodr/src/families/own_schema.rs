//! Facts that the schema of the file's own version already reports. Only files with something
//! unusual evaluate it, because it requires a walk through the document.

use std::cell::OnceCell;

use crate::prelude::*;
use qcbus_document::Attribute;
use qcbus_document::FileKind;
use qcbus_schema::{Typing, version_of};

/// Types of a document according to the schema of the version in its header.
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

    /// Checks whether the schema lists the words of an attribute and therefore reports other words.
    pub fn lists(&self, attribute: Attribute<'_>) -> bool {
        let value = self.typing().and_then(|typing| typing.value(attribute));
        value.is_some_and(|value| value.words().is_some())
    }

    /// Checks whether the schema requires an attribute and therefore reports that it is missing.
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

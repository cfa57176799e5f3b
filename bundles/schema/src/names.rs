//! Interned element and attribute names: a schema compares names as small numbers.

use std::collections::HashMap;

/// A name inside one [`crate::Schema`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NameId(pub(crate) u16);

impl NameId {
    /// A name of the document that the schema never mentions.
    pub(crate) const UNKNOWN: NameId = NameId(u16::MAX);
}

/// All names a schema mentions, each once.
#[derive(Clone, Debug, Default)]
pub struct Names {
    texts: Vec<Box<str>>,
    ids: HashMap<Box<str>, u16>,
}

impl Names {
    /// The number for `name`, given out on first sight; `None` once 65,534 names are taken.
    pub(crate) fn intern(&mut self, name: &str) -> Option<NameId> {
        if let Some(&id) = self.ids.get(name) {
            return Some(NameId(id));
        }
        let id = u16::try_from(self.texts.len())
            .ok()
            .filter(|&id| id < NameId::UNKNOWN.0)?;
        self.texts.push(name.into());
        self.ids.insert(name.into(), id);
        Some(NameId(id))
    }

    /// The number of a name the schema mentions.
    pub(crate) fn find(&self, name: &str) -> Option<NameId> {
        self.ids.get(name).map(|&id| NameId(id))
    }

    /// The text of a name; empty for one that is not of this schema.
    pub fn text(&self, id: NameId) -> &str {
        self.texts.get(usize::from(id.0)).map_or("", |text| text)
    }

    /// Bytes held, for the memory figure.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.texts.iter().map(|text| 2 * text.len() + 56).sum()
    }
}

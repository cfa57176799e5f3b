//! Interned element and attribute names. A schema compares names as small numbers.

use std::collections::HashMap;

/// Number of a name in one [`crate::Schema`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NameId(pub(crate) u16);

impl NameId {
    /// Number of all names that the schema does not contain.
    pub(crate) const UNKNOWN: NameId = NameId(u16::MAX);
}

/// All distinct names of a schema.
#[derive(Clone, Debug, Default)]
pub struct Names {
    texts: Vec<Box<str>>,
    ids: HashMap<Box<str>, u16>,
}

impl Names {
    /// Returns the number of `name`, assigned on first use; `None` if 65,534 names are in use.
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

    /// Returns the number of a name, if the schema contains it.
    pub(crate) fn find(&self, name: &str) -> Option<NameId> {
        self.ids.get(name).map(|&id| NameId(id))
    }

    /// Returns the text of a name. It is empty for a name of another schema.
    pub fn text(&self, id: NameId) -> &str {
        self.texts.get(usize::from(id.0)).map_or("", |text| text)
    }
}

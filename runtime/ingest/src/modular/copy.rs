//! A maneuver group on its way into the expanded scenario.

use std::collections::BTreeMap;
use std::sync::Arc;

use qcbus_document::{Attribute, Node};

/// A value that replaces another one, and where it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Value {
    /// The value, entities resolved.
    pub text: Arc<str>,
    /// The piece whose text has it.
    pub piece: usize,
    /// Where it is written in the text of the piece.
    pub offset: u32,
    /// Bytes of it there.
    pub raw_len: u32,
}

impl Value {
    /// The value of an attribute of a piece.
    pub(super) fn of(piece: usize, attribute: Attribute<'_>) -> Value {
        Value {
            text: attribute.value().into(),
            piece,
            offset: attribute.value_offset(),
            raw_len: attribute.raw_len(),
        }
    }

    /// Another value that comes from the same place.
    pub(super) fn saying(&self, text: &str) -> Value {
        Value {
            text: text.into(),
            ..self.clone()
        }
    }
}

/// A maneuver group of a piece, with what is replaced in it.
#[derive(Debug, Clone)]
pub struct Copy<'d> {
    /// The piece that it is from.
    pub piece: usize,
    /// The group there.
    pub group: Node<'d>,
    /// Its new name; `None` where it keeps its own.
    pub name: Option<Value>,
    /// New values of attributes, by the offset of the attribute's name.
    pub edits: BTreeMap<u32, Value>,
}

impl<'d> Copy<'d> {
    /// A group as it is.
    pub(super) fn as_is(piece: usize, group: Node<'d>) -> Copy<'d> {
        Copy {
            piece,
            group,
            name: None,
            edits: BTreeMap::new(),
        }
    }

    /// What it is called.
    pub fn name(&self) -> &str {
        match &self.name {
            Some(value) => &value.text,
            None => self.group.attr("name").unwrap_or(""),
        }
    }

    /// What replaces the value of an attribute of the group or of an element in it.
    pub fn edit(&self, attribute: Attribute<'_>) -> Option<&Value> {
        let of_group = attribute.node() == self.group && attribute.is("name");
        match &self.name {
            Some(name) if of_group => Some(name),
            _ => self.edits.get(&attribute.offset()),
        }
    }
}

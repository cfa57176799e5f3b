//! A copy of a maneuver group for the expanded scenario.

use std::collections::BTreeMap;
use std::sync::Arc;

use qcbus_document::{Attribute, Node};

/// A replacement value and the place where it is written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Value {
    /// The value with resolved entities.
    pub text: Arc<str>,
    /// Index of the piece that contains the value.
    pub piece: usize,
    /// Offset of the value in the text of the piece.
    pub offset: u32,
    /// Length of the raw value in bytes.
    pub raw_len: u32,
}

impl Value {
    /// Returns the value of an attribute of a piece.
    pub(super) fn of(piece: usize, attribute: Attribute<'_>) -> Value {
        Value {
            text: attribute.value().into(),
            piece,
            offset: attribute.value_offset(),
            raw_len: attribute.raw_len(),
        }
    }

    /// Returns another value with the same place.
    pub(super) fn saying(&self, text: &str) -> Value {
        Value {
            text: text.into(),
            ..self.clone()
        }
    }
}

/// A maneuver group of a piece with its replacements.
#[derive(Debug, Clone)]
pub struct Copy<'d> {
    /// Index of the piece that contains the group.
    pub piece: usize,
    /// The group in that piece.
    pub group: Node<'d>,
    /// New name of the group, or `None` if it keeps its own.
    pub name: Option<Value>,
    /// New values of attributes, by the offset of the attribute's name.
    pub edits: BTreeMap<u32, Value>,
}

impl<'d> Copy<'d> {
    /// Returns an unchanged copy of a group.
    pub(super) fn as_is(piece: usize, group: Node<'d>) -> Copy<'d> {
        Copy {
            piece,
            group,
            name: None,
            edits: BTreeMap::new(),
        }
    }

    /// Returns the name of the copy.
    pub fn name(&self) -> &str {
        match &self.name {
            Some(value) => &value.text,
            None => self.group.attr("name").unwrap_or(""),
        }
    }

    /// Returns the new value for an attribute of the group or of an element in it, or `None`.
    pub fn edit(&self, attribute: Attribute<'_>) -> Option<&Value> {
        let of_group = attribute.node() == self.group && attribute.is("name");
        match &self.name {
            Some(name) if of_group => Some(name),
            _ => self.edits.get(&attribute.offset()),
        }
    }
}

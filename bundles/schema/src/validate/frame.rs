//! State of the open elements.

use std::collections::HashMap;

use super::keys::Mark;
use super::types::Kind;
use crate::model::{AllModel, Content, Model};
use crate::names::NameId;

/// An open element.
#[derive(Debug)]
pub(super) struct Frame<'s> {
    pub(super) node: u32,
    pub(super) end: u32,
    pub(super) body: Body<'s>,
    pub(super) mixed: bool,
    pub(super) keys: Mark,
    /// Children already reported as missing or misplaced, so that one cause is not reported twice.
    /// It is empty and needs no allocation for a valid element.
    pub(super) troubles: Vec<NameId>,
    /// State of the automaton at the last unknown child. If no child followed, the unknown child
    /// probably replaces the missing one.
    pub(super) stranger: Option<u16>,
    /// Number of unknown children in an `all` group.
    pub(super) strangers: u32,
    /// Number of children for each name. It is computed at the first wrong child.
    pub(super) numbers: Option<HashMap<NameId, Number>>,
}

/// Count of the children with one name.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Number {
    pub(super) children: u32,
    /// Whether the excess was reported.
    pub(super) told: bool,
}

/// Allowed content of an open element, with the current position in it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Body<'s> {
    Nothing,
    Text(u32),
    Children { model: &'s Model, state: u16 },
    All { model: &'s AllModel, seen: u64 },
}

impl<'s> Body<'s> {
    pub(super) fn of(kind: Kind<'s>) -> Self {
        match kind {
            Kind::Simple(id) => Body::Text(id),
            Kind::Complex(_, ty) => match &ty.content {
                Content::Empty => Body::Nothing,
                Content::Text(id) => Body::Text(*id),
                Content::Children(model) => Body::Children { model, state: 0 },
                Content::All(model) => Body::All { model, seen: 0 },
            },
        }
    }

    pub(super) fn is_mixed(kind: Kind<'s>) -> bool {
        matches!(kind, Kind::Complex(_, ty) if ty.mixed)
    }
}

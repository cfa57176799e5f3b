//! The open elements.

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
    /// Children already reported as missing or misplaced: the same cause is not reported twice.
    /// Empty, and so without allocation, for every sound element.
    pub(super) troubles: Vec<NameId>,
    /// Where the last unknown child stood: the state of the automaton. If nothing has come since,
    /// that child probably stands for the one that is missing.
    pub(super) stranger: Option<u16>,
    /// How many unknown children an `all` group met.
    pub(super) strangers: u32,
    /// The children, counted by name once one of them is wrong.
    pub(super) numbers: Option<HashMap<NameId, Number>>,
}

/// The children of one name.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Number {
    pub(super) children: u32,
    /// That they are too many was said.
    pub(super) told: bool,
}

/// What an open element may contain, and how far it has come.
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

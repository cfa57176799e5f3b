//! Types of the attributes of copied groups, by the version of the scenario that takes them.

use std::collections::HashMap;

use crate::assembly::Assembly;
use crate::prelude::*;
use qcbus_schema::Typing;

/// The types of documents in the version of the root. Each is computed on first use.
#[derive(Default)]
pub struct Typings(HashMap<usize, Option<Typing>>);

impl Typings {
    /// Returns the types of a piece. If the root names no version, the piece's version applies.
    pub fn of(&mut self, assembly: &Assembly<'_>, piece: usize) -> Option<&Typing> {
        let typing = self.0.entry(piece).or_insert_with(|| {
            let document = assembly.piece(piece);
            let version = assembly
                .version_of(assembly.root())
                .or_else(|| assembly.version_of(document))?;
            Typing::of(&document, FileKind::Xosc, version)
        });
        typing.as_ref()
    }
}

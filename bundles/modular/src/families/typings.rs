//! The types that the attributes of copied groups have in the scenario that takes them.

use std::collections::HashMap;

use qcbus_document::FileKind;
use qcbus_schema::Typing;

use crate::assembly::Assembly;

/// The types of documents in the version of the root, each found when it is first asked for.
#[derive(Default)]
pub struct Typings(HashMap<usize, Option<Typing>>);

impl Typings {
    /// The types of a piece. Where the root names no version, those of the piece's own.
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

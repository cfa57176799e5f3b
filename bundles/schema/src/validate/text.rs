//! Validation of character data.

use qcbus_document::Node;

use super::frame::Body;
use super::{Walk, wording};
use crate::simple::{Builtin, Variety, XML_SPACE};
use crate::violation::Code;
use crate::work::steps;

/// Maximum length of searched end tags.
const MAX_END_TAG: usize = 256;

impl<'a> Walk<'a, '_> {
    /// Visits character data and returns the index of the next node.
    pub(super) fn run_of_text(&mut self, node: Node<'a>) -> u32 {
        let next = node.subtree_end();
        let Some(frame) = self.stack.last() else {
            return next;
        };
        let bare = !frame.mixed && !matches!(frame.body, Body::Text(_));
        let text = node.character_run();
        if !bare || text.trim_matches(XML_SPACE).is_empty() {
            return next;
        }
        if let Some(parent) = self.document.node(frame.node) {
            let key = (0, u32::from(parent.name_number()));
            self.reporter.add(Code::UnexpectedText, key, parent, || {
                wording::unexpected_text(parent, text)
            });
        }
        next
    }

    /// Checks for white space in an element without content, which XML Schema forbids. The image
    /// does not contain it, but the source text does.
    pub(super) fn emptiness(&mut self, node: Node<'a>, body: Body<'_>, mixed: bool) {
        if mixed || !matches!(body, Body::Nothing) || node.subtree_end() > node.index() + 1 {
            return;
        }
        let end = node.end_offset();
        let after = self.sources.partition_point(|(start, _)| *start < end);
        let source = after
            .checked_sub(1)
            .and_then(|index| self.sources.get(index));
        steps(1);
        let Some(bytes) =
            source.and_then(|(start, text)| text.as_bytes().get(..(end - start) as usize))
        else {
            return;
        };
        if bytes.ends_with(b"/>") {
            return;
        }
        let name = bytes
            .iter()
            .rev()
            .take(MAX_END_TAG)
            .position(|&byte| byte == b'<');
        let before = name.and_then(|back| bytes.get(bytes.len().checked_sub(back + 2)?));
        if before.is_some_and(|byte| matches!(byte, b' ' | b'\t' | b'\n' | b'\r')) {
            let key = (1, u32::from(node.name_number()));
            self.reporter.add(Code::UnexpectedText, key, node, || {
                wording::blank_text(node)
            });
        }
    }

    /// Checks the text of an element that consists of text.
    pub(super) fn text_content(&mut self, node: Node<'a>, body: Body<'_>) {
        let Body::Text(id) = body else { return };
        let Some(ty) = self.schema.simple.get(id as usize) else {
            return;
        };
        let anything = matches!(
            ty.variety,
            Variety::Atomic(Builtin::String | Builtin::AnySimple)
        ) && ty.facets.is_plain();
        if anything {
            return;
        }
        let text = node.text();
        if !ty.accepts(&text, self.schema) {
            let key = (id as usize, u32::from(node.name_number()));
            self.reporter.add(Code::InvalidText, key, node, || {
                wording::invalid_text(node, &text, ty, self.schema)
            });
        }
    }
}

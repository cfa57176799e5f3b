//! Builds a document image of the expanded scenario.

use qcbus_document::{Attribute, BuildError, Capacities, ImageBuilder, Node};
use sha2::{Digest, Sha256};

use super::OFFERS;
use super::copy::Copy;
use super::plan::Expansion;
use super::text::text_of;
use crate::xml::{Counter, Halt, Sink};

/// An expanded scenario from which an image can be built. Its text consists of the texts of its
/// files. The root comes first, so that offsets in the root stay the same. Its tree is the expanded
/// one. The name of a replaced attribute is located in the library. Its value is located in the
/// referring file: [`Attribute::value_offset`] leads there.
#[derive(Debug)]
pub struct ExpandedImage<'e, 'd> {
    expansion: &'e Expansion<'d>,
    texts: Vec<&'d str>,
    /// Start of each piece's text in the text of the image.
    starts: Vec<u32>,
    capacities: Capacities,
}

impl<'d> Expansion<'d> {
    /// Prepares the expanded scenario for an image of at most `max_image` bytes. Returns `None`
    /// when the expansion is not complete or the image would be larger.
    pub fn image(&self, max_image: u64) -> Option<ExpandedImage<'_, 'd>> {
        if !self.is_complete() {
            return None;
        }
        let mut next = 0usize;
        let mut starts = vec![0; self.pieces.len()];
        let mut texts = vec![""; self.pieces.len()];
        for &piece in &self.used {
            texts[piece] = text_of(self.pieces[piece].document);
            starts[piece] = u32::try_from(next).ok()?;
            next += texts[piece].len() + 1;
        }
        let mut image = ExpandedImage {
            expansion: self,
            texts,
            starts,
            capacities: Capacities::default(),
        };
        let max_image = usize::try_from(max_image)
            .unwrap_or(usize::MAX)
            .min(u32::MAX as usize);
        let mut counter = Counter::new(image.known(), max_image);
        image.tree(&mut counter).ok()?;
        image.capacities = counter.counted;
        (image.upper_bound() <= max_image).then_some(image)
    }
}

impl ExpandedImage<'_, '_> {
    /// Returns the number of bytes that [`ExpandedImage::build_into`] needs.
    pub fn upper_bound(&self) -> usize {
        self.capacities.image_len()
    }

    /// Returns the digest over the files that the scenario consists of.
    pub fn digest(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        for piece in &self.expansion.pieces {
            hash.update(piece.document.path());
            hash.update([0]);
            hash.update(piece.document.content_hash());
        }
        hash.finalize().into()
    }

    /// Builds the image into the first bytes of `out` and returns its length.
    ///
    /// # Errors
    /// [`BuildError::SmallBuffer`] when `out` is shorter than [`ExpandedImage::upper_bound`].
    pub fn build_into(&self, out: &mut [u8]) -> Result<usize, BuildError> {
        let mut builder = ImageBuilder::new(out, &self.capacities)?;
        for &piece in &self.expansion.used {
            let path = self.expansion.pieces[piece].document.path();
            builder.source(path, self.texts[piece])?;
        }
        match self.tree(&mut builder) {
            Ok(()) => {}
            Err(Halt::Build(error)) => return Err(error),
            Err(Halt::TooLarge(found)) => {
                let needed = found;
                return Err(BuildError::SmallBuffer { found: 0, needed });
            }
        }
        for &piece in &self.expansion.used {
            for fault in self.expansion.pieces[piece].document.faults() {
                let offset = self.starts[piece].saturating_add(fault.offset);
                builder.fault(fault.code, offset, fault.text)?;
            }
        }
        builder.finish(self.digest())
    }

    /// Builds the image into a new buffer. If that fails, the buffer is empty and cannot be opened
    /// as an image.
    pub fn build(&self) -> Vec<u8> {
        let mut image = vec![0; self.upper_bound()];
        let len = self.build_into(&mut image).unwrap_or(0);
        image.truncate(len);
        image
    }

    fn known(&self) -> Capacities {
        let used = || self.expansion.used.iter().copied();
        let document = |piece: usize| self.expansion.pieces[piece].document;
        let faults = || used().flat_map(|piece| document(piece).faults());
        let paths: usize = used().map(|piece| document(piece).path().len()).sum();
        Capacities {
            text: used().map(|piece| self.texts[piece].len() + 1).sum(),
            sources: self.expansion.used.len(),
            faults: faults().count(),
            heap: paths + faults().map(|fault| fault.text.len()).sum::<usize>(),
            ..Capacities::default()
        }
    }

    fn tree(&self, sink: &mut impl Sink) -> Result<(), Halt> {
        match self.expansion.pieces[0].document.root() {
            Some(root) => self.subtree(sink, 0, root, None),
            None => Ok(()),
        }
    }

    fn subtree(
        &self,
        sink: &mut impl Sink,
        piece: usize,
        top: Node<'_>,
        copy: Option<&Copy<'_>>,
    ) -> Result<(), Halt> {
        let document = top.document();
        let mut open: Vec<(u32, u32)> = Vec::new();
        let mut next = top.index();
        while next < top.subtree_end() {
            close_before(sink, &mut open, next)?;
            let Some(node) = document.node(next) else {
                break;
            };
            let replaced = self.expansion.replaced.get(&next);
            if let Some(copies) = replaced.filter(|_| piece == 0 && copy.is_none()) {
                for copy in copies {
                    self.subtree(sink, copy.piece, copy.group, Some(copy))?;
                }
                next = node.subtree_end();
                continue;
            }
            if node.is_element() {
                self.element(sink, piece, node, copy)?;
                let stop = self.starts[piece].saturating_add(node.end_offset());
                open.push((node.subtree_end(), stop));
            } else {
                self.characters(sink, piece, node)?;
            }
            next += 1;
        }
        close_before(sink, &mut open, u32::MAX)
    }

    fn element(
        &self,
        sink: &mut impl Sink,
        piece: usize,
        node: Node<'_>,
        copy: Option<&Copy<'_>>,
    ) -> Result<(), Halt> {
        let start = self.starts[piece];
        let prefix = node.prefix();
        let at = start.saturating_add(node.offset());
        if prefix.is_empty() {
            sink.open(node.name(), at)?;
        } else {
            sink.open(&format!("{prefix}:{}", node.name()), at)?;
        }
        for attribute in node.attributes().filter(|attribute| !attribute.is(OFFERS)) {
            let name_at = start.saturating_add(attribute.offset());
            match copy.and_then(|copy| copy.edit(attribute)) {
                Some(new) => sink.attribute(
                    attribute.name(),
                    name_at,
                    self.starts[new.piece].saturating_add(new.offset),
                    new.raw_len,
                    Some(&new.text),
                )?,
                None => sink.attribute(
                    attribute.name(),
                    name_at,
                    start.saturating_add(attribute.value_offset()),
                    attribute.raw_len(),
                    self.resolved(piece, attribute),
                )?,
            }
        }
        Ok(())
    }

    /// Returns the value of an attribute if it differs from the written text.
    fn resolved<'a>(&self, piece: usize, attribute: Attribute<'a>) -> Option<&'a str> {
        let at = attribute.value_offset() as usize;
        let written = self.texts[piece].get(at..at + attribute.raw_len() as usize);
        let value = attribute.value();
        (written != Some(value)).then_some(value)
    }

    fn characters(&self, sink: &mut impl Sink, piece: usize, run: Node<'_>) -> Result<(), Halt> {
        let written = run.character_range();
        let value = run.character_run();
        let raw = self.texts[piece].get(written.start as usize..written.end as usize);
        let start = self.starts[piece];
        sink.text(
            start.saturating_add(written.start),
            start.saturating_add(written.end),
            (raw != Some(value)).then_some(value),
        )
    }
}

/// Closes the elements that end before a node.
fn close_before(sink: &mut impl Sink, open: &mut Vec<(u32, u32)>, next: u32) -> Result<(), Halt> {
    while let Some(&(end, stop)) = open.last() {
        if end > next {
            break;
        }
        sink.close(stop)?;
        open.pop();
    }
    Ok(())
}

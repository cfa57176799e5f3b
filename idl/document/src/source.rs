//! Conversion of an offset of the text to a file, a row and a column.

use crate::document::Document;
use crate::layout::{LINE_STRIDE, LineRecord, Section, SourceRecord};
use crate::lines::Tally;
use crate::position::{Position, Source};

impl<'a> Document<'a> {
    /// Returns the path of the file that the image is named after; empty when the image has no
    /// text.
    pub fn path(&self) -> &'a str {
        self.sources().next().map_or("", |source| source.path)
    }

    /// Returns the files whose bytes make up the text, the root file first.
    pub fn sources(&self) -> impl Iterator<Item = Source<'a>> + use<'a> {
        let document = *self;
        let records: &'a [SourceRecord] = self.records(Section::Sources);
        records.iter().map(move |record| document.source(record))
    }

    /// Returns the text of a source. It validates every byte, so use [`Document::source_bytes`] to
    /// read one line of many.
    pub fn source_text(&self, source: &Source<'a>) -> &'a str {
        self.text_at(source.start, source.len).unwrap_or("")
    }

    /// Returns the bytes of a source; they are UTF-8 unless the image is damaged.
    pub fn source_bytes(&self, source: &Source<'a>) -> &'a [u8] {
        let text: &'a [u8] = self.section(Section::Text);
        let from = source.start as usize;
        text.get(from..from.saturating_add(source.len as usize))
            .unwrap_or_default()
    }

    /// Converts an offset of the text to its file, row and column. An offset just past the end of a
    /// file belongs to that file. An offset past the end of the text counts as the end.
    pub fn position(&self, offset: u32) -> Position<'a> {
        let text: &'a [u8] = self.section(Section::Text);
        let offset = offset.min(u32::try_from(text.len()).unwrap_or(u32::MAX));
        let records: &'a [SourceRecord] = self.records(Section::Sources);
        let number = records
            .partition_point(|record| record.start.get() <= offset)
            .saturating_sub(1);
        let Some(record) = records.get(number) else {
            return Position {
                path: "",
                row: 1,
                column: 1,
                offset,
                is_root_file: true,
            };
        };
        let start = record.start.get().min(offset);
        let tally = self.tally(text, start as usize, offset as usize);
        let marked = tally.feeds == 0
            && offset > start
            && text
                .get(start as usize..)
                .is_some_and(|file| file.starts_with(BYTE_ORDER_MARK));
        Position {
            path: self.source(record).path,
            row: tally.feeds.saturating_add(1),
            column: tally.characters.saturating_add(1 - u32::from(marked)),
            offset: offset - start,
            is_root_file: number == 0,
        }
    }

    /// Counts from the nearest checkpoint at or before `offset`, or from the file's start when that
    /// is nearer.
    fn tally(&self, text: &[u8], start: usize, offset: usize) -> Tally {
        let checkpoints = self.records::<LineRecord>(Section::Lines).len();
        let checkpoint = (offset / LINE_STRIDE).min(checkpoints.saturating_sub(1));
        let (mut tally, from) = match self.record::<LineRecord>(Section::Lines, checkpoint) {
            Some(line) if checkpoint * LINE_STRIDE > start => {
                (Tally::of(line), checkpoint * LINE_STRIDE)
            }
            // The file starts in this stride, or the image is corrupt. One stride limits the cost.
            _ => (
                Tally::default(),
                start.max(offset.saturating_sub(LINE_STRIDE)),
            ),
        };
        tally.count(text.get(from..offset).unwrap_or(&[]));
        tally
    }

    fn source(&self, record: &SourceRecord) -> Source<'a> {
        Source {
            path: self
                .heap_at(record.path_offset.get(), record.path_len.get())
                .unwrap_or(""),
            start: record.start.get(),
            len: record.len.get(),
        }
    }
}

/// UTF-8 encoding of U+FEFF, which some editors write at the start of a file.
const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";

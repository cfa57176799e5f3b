//! Counting of line feeds and characters, fast enough for every byte of every file.

use crate::layout::{LINE_STRIDE, LineRecord, U32};

/// Number of line feeds, and number of characters since the last one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) feeds: u32,
    pub(crate) characters: u32,
}

impl Tally {
    pub(crate) fn of(record: &LineRecord) -> Tally {
        Tally {
            feeds: record.feeds.get(),
            characters: record.characters.get(),
        }
    }

    pub(crate) fn record(self) -> LineRecord {
        LineRecord {
            feeds: U32::new(self.feeds),
            characters: U32::new(self.characters),
        }
    }

    /// Continues the count over `text`, which may start and end within a character. A character is
    /// counted at its first byte.
    pub(crate) fn count(&mut self, text: &[u8]) {
        let last_line = match text.iter().rposition(|&byte| byte == b'\n') {
            Some(feed) => {
                self.feeds = self
                    .feeds
                    .saturating_add(occurrences(text, |byte| byte == b'\n'));
                self.characters = 0;
                &text[feed + 1..]
            }
            None => text,
        };
        let characters = occurrences(last_line, |byte| byte & 0xC0 != 0x80);
        self.characters = self.characters.saturating_add(characters);
    }
}

/// Returns the checkpoints of a text, one for each started stride. The text consists of files that
/// start at `starts` (ascending, the first at 0).
pub(crate) fn checkpoints<'t>(
    text: &'t [u8],
    starts: impl Iterator<Item = usize> + 't,
) -> impl Iterator<Item = LineRecord> + 't {
    let mut starts = starts.peekable();
    let mut tally = Tally::default();
    text.chunks(LINE_STRIDE)
        .enumerate()
        .map(move |(number, chunk)| {
            let begin = number * LINE_STRIDE;
            if starts.next_if(|&start| start == begin).is_some() {
                tally = Tally::default();
            }
            let record = tally.record();
            let mut from = 0;
            while let Some(start) = starts.next_if(|&start| start < begin + chunk.len()) {
                // Another file starts within this stride, so only the bytes after its start count.
                tally = Tally::default();
                from = start.saturating_sub(begin);
            }
            tally.count(chunk.get(from..).unwrap_or(&[]));
            record
        })
}

/// Counts the bytes that satisfy `wanted`. The count of a block fits into one byte, so that the
/// compiler can vectorise the loop.
fn occurrences(text: &[u8], wanted: impl Fn(u8) -> bool) -> u32 {
    let count = |block: &[u8]| block.iter().map(|&byte| u8::from(wanted(byte))).sum::<u8>();
    let (blocks, rest) = text.as_chunks::<128>();
    let total: u32 = blocks.iter().map(|block| u32::from(count(block))).sum();
    total + u32::from(count(rest))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn characters_and_line_feeds_are_counted() {
        let mut tally = Tally::default();
        tally.count("ab\nüß€".as_bytes());
        assert_eq!(
            tally,
            Tally {
                feeds: 1,
                characters: 3
            }
        );
        tally.count(b"xy");
        assert_eq!(
            tally,
            Tally {
                feeds: 1,
                characters: 5
            }
        );
    }

    #[test]
    fn long_blocks_do_not_overflow_counters() {
        let text = "é".repeat(40_000);
        let mut tally = Tally::default();
        tally.count(text.as_bytes());
        assert_eq!(tally.characters, 40_000);
        tally.count(&vec![b'\n'; 70_001]);
        assert_eq!(
            tally,
            Tally {
                feeds: 70_001,
                characters: 0
            }
        );
    }

    #[test]
    fn checkpoints_restart_with_every_file() {
        let text = vec![b'\n'; 3 * LINE_STRIDE];
        let feeds = |starts: Vec<usize>| -> Vec<u32> {
            checkpoints(&text, starts.into_iter())
                .map(|line| line.feeds.get())
                .collect()
        };
        assert_eq!(feeds(vec![0]), [0, 4096, 8192]);
        assert_eq!(feeds(vec![0, 4096]), [0, 0, 4096]);
        assert_eq!(feeds(vec![0, 10, 20]), [0, 4076, 8172]);
    }
}

//! Lines of the checked files, for reports that show them.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ops::Deref;
use std::time::SystemTime;

use qcbus_document::Document;
use qcbus_ingest::{Limits, Prepared};
use qcbus_messages::path_text::from_text;
use qcbus_messages::{Digest, ResultMessage};

/// Access to lines of files. It never returns a line that may differ from the checked one.
pub trait Sources {
    /// Returns line `row` (from 1) of the file at `path`, without its end. For a very long line, it
    /// returns the part around the character at column `near` (from 1).
    fn line(&self, path: &str, row: u64, near: u64) -> Option<Line>;

    /// Calls `look` with the image of the file at `path` if it matches the checked bytes. The image
    /// is used in place if it is still on the bus.
    fn image(&self, path: &str, look: &mut dyn FnMut(&[u8])) {
        let _ = (path, look);
    }
}

/// A line or part of a very long one. Some maps have a single line of many megabytes.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Line {
    /// Characters of the line or part.
    pub text: String,
    /// Number of characters of the line before `text`.
    pub skipped: u64,
    /// Whether the line continues after `text`.
    pub goes_on: bool,
}

impl From<&str> for Line {
    fn from(text: &str) -> Line {
        Line {
            text: text.to_owned(),
            ..Line::default()
        }
    }
}

/// Number of characters that are returned on each side of the requested column.
const REACH: usize = 1000;

/// A source without any lines.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoSources;

impl Sources for NoSources {
    fn line(&self, _: &str, _: u64, _: u64) -> Option<Line> {
        None
    }
}

/// Lines from a document image: lines of the root file and of the files that it includes.
pub struct ImageSources<B> {
    image: B,
    input: String,
    files: RefCell<BTreeMap<String, Index>>,
}

/// Answer of a source about a line.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Answer {
    /// The line exists.
    Line(Line),
    /// The file is known, but the line does not exist.
    NoSuchLine,
    /// The file is not part of this source.
    OtherFile,
}

impl<B: Deref<Target = [u8]>> ImageSources<B> {
    /// Creates a source of the lines of `image` with the file at `input` as root. Files with equal
    /// bytes share an image, so it may name its root differently. A damaged image gives no lines.
    pub fn new(image: B, input: &str) -> ImageSources<B> {
        ImageSources {
            image,
            input: input.to_owned(),
            files: RefCell::default(),
        }
    }

    /// Checks whether the image's root has this path, and not that of another file with equal
    /// bytes.
    fn is_named(&self, path: &str) -> bool {
        let named = |document: Document<'_>| {
            let rest = document.path().strip_prefix(path);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('!'))
        };
        Document::open(&self.image).is_ok_and(named)
    }

    /// Returns the line if the image contains the file.
    pub fn answer(&self, path: &str, row: u64, near: u64) -> Answer {
        let Ok(document) = Document::open(&self.image) else {
            return Answer::OtherFile;
        };
        let mut sources = document.sources();
        let source = if path == self.input {
            sources.next()
        } else {
            sources.skip(1).find(|source| source.path == path)
        };
        let Some(source) = source else {
            return Answer::OtherFile;
        };
        let text = document.source_bytes(&source);
        let mut files = self.files.borrow_mut();
        let index = files
            .entry(path.to_owned())
            .or_insert_with(|| Index::of(text));
        match index.line(text, row) {
            Some(line) => Answer::Line(index.part(line, near)),
            None => Answer::NoSuchLine,
        }
    }
}

impl<B: Deref<Target = [u8]>> Sources for ImageSources<B> {
    fn line(&self, path: &str, row: u64, near: u64) -> Option<Line> {
        match self.answer(path, row, near) {
            Answer::Line(line) => Some(line),
            Answer::NoSuchLine | Answer::OtherFile => None,
        }
    }

    fn image(&self, path: &str, look: &mut dyn FnMut(&[u8])) {
        if path == self.input {
            look(&self.image);
        }
    }
}

/// Lines from an image if it contains the file, otherwise from the disk.
pub struct BothSources<B> {
    /// Image, which is used first.
    pub image: Option<ImageSources<B>>,
    /// Files on disk, for files outside of the image.
    pub files: FileSources,
}

impl<B: Deref<Target = [u8]>> Sources for BothSources<B> {
    fn line(&self, path: &str, row: u64, near: u64) -> Option<Line> {
        let answer = self
            .image
            .as_ref()
            .map(|image| image.answer(path, row, near));
        match answer {
            Some(Answer::Line(line)) => Some(line),
            Some(Answer::NoSuchLine) => None,
            Some(Answer::OtherFile) | None => self.files.line(path, row, near),
        }
    }

    fn image(&self, path: &str, look: &mut dyn FnMut(&[u8])) {
        match &self.image {
            // The references of an image depend on the directory of its root.
            Some(image) if image.input == path && image.is_named(path) => image.image(path, look),
            _ => self.files.image(path, look),
        }
    }
}

/// Lines of files on disk, read as the broker reads them: packed, in any encoding. The checked file
/// must still have the checked bytes. A file without a known digest must be older than the result.
pub struct FileSources {
    input: String,
    digest: Digest,
    written: Option<SystemTime>,
    files: RefCell<BTreeMap<String, Option<FileSource>>>,
}

/// A file on disk. Its image is built only on request, because lines do not need it.
struct FileSource {
    prepared: Prepared,
    index: Index,
    image: Option<Vec<u8>>,
}

impl FileSources {
    /// Creates a source for the files of this result.
    pub fn new(result: &ResultMessage) -> FileSources {
        FileSources {
            input: result.input.clone(),
            digest: result.digest,
            written: modified(&result.xqar),
            files: RefCell::default(),
        }
    }

    /// Calls `look` with the file if it is unchanged.
    fn with<T>(&self, path: &str, look: impl FnOnce(&mut FileSource) -> T) -> Option<T> {
        let mut files = self.files.borrow_mut();
        let file = files
            .entry(path.to_owned())
            .or_insert_with(|| self.open(path));
        file.as_mut().map(look)
    }

    fn open(&self, path: &str) -> Option<FileSource> {
        let file = from_text(path);
        // A member of an archive has the modification time of the archive.
        let on_disk = if file.is_file() {
            path
        } else {
            path.split_once('!')?.0
        };
        if !file.is_absolute() || !from_text(on_disk).is_file() {
            return None;
        }
        let known = path == self.input && self.digest != Digest::default();
        if !known && modified(on_disk)? > self.written? {
            return None;
        }
        let boundary = file.parent()?;
        let prepared = qcbus_ingest::prepare(&file, boundary, &Limits::default()).ok()?;
        if known && Digest(prepared.digest()) != self.digest {
            return None;
        }
        Some(FileSource {
            index: Index::of(prepared.text().as_bytes()),
            prepared,
            image: None,
        })
    }
}

impl Sources for FileSources {
    fn line(&self, path: &str, row: u64, near: u64) -> Option<Line> {
        self.with(path, |file| {
            let line = file.index.line(file.prepared.text().as_bytes(), row)?;
            Some(file.index.part(line, near))
        })?
    }

    fn image(&self, path: &str, look: &mut dyn FnMut(&[u8])) {
        self.with(path, |file| {
            let FileSource {
                prepared, image, ..
            } = file;
            look(image.get_or_insert_with(|| prepared.build()));
        });
    }
}

fn modified(path: &str) -> Option<SystemTime> {
    std::fs::metadata(from_text(path)).ok()?.modified().ok()
}

/// Start positions of the lines of a file.
struct Index {
    starts: Vec<u32>,
    ascii: bool,
}

impl Index {
    fn of(text: &[u8]) -> Index {
        let feeds = memchr::memchr_iter(b'\n', text);
        let after = feeds.filter_map(|at| u32::try_from(at + 1).ok());
        Index {
            starts: std::iter::once(0).chain(after).collect(),
            ascii: text.is_ascii(),
        }
    }

    fn line<'t>(&self, text: &'t [u8], row: u64) -> Option<&'t str> {
        let row = usize::try_from(row).ok()?.checked_sub(1)?;
        let start = *self.starts.get(row)? as usize;
        let end = self.starts.get(row + 1).map_or(text.len(), |&n| n as usize);
        let line = std::str::from_utf8(text.get(start..end)?).ok()?;
        let line = line.trim_end_matches(['\n', '\r']);
        let marked = line.strip_prefix('\u{FEFF}').filter(|_| row == 0);
        Some(marked.unwrap_or(line))
    }

    /// Returns the part of the line around a column. In a pure ASCII file, characters are bytes.
    fn part(&self, line: &str, near: u64) -> Line {
        if line.len() <= 2 * REACH {
            return Line::from(line);
        }
        let near = usize::try_from(near).unwrap_or(usize::MAX);
        let first = near.saturating_sub(REACH);
        let byte_of = |character: usize| match self.ascii {
            true => character.min(line.len()),
            false => line
                .char_indices()
                .nth(character)
                .map_or(line.len(), |(at, _)| at),
        };
        let start = byte_of(first);
        let rest = &line[start..];
        let mut ends = rest.char_indices().skip(2 * REACH);
        let end = ends.next().map_or(rest.len(), |(at, _)| at);
        Line {
            text: rest[..end].to_owned(),
            skipped: first as u64,
            goes_on: end < rest.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_counted_by_line_feeds() {
        let text = "\u{FEFF}one\r\ntwo\n\nfour";
        let index = Index::of(text.as_bytes());
        let row = |row| index.line(text.as_bytes(), row);
        assert_eq!(row(0), None);
        assert_eq!(row(1), Some("one"));
        assert_eq!(row(2), Some("two"));
        assert_eq!(row(3), Some(""));
        assert_eq!(row(4), Some("four"));
        assert_eq!(row(5), None);
        assert_eq!(row(u64::MAX), None);
    }

    #[test]
    fn only_part_of_very_long_line_is_returned() {
        for letter in ["a", "ü"] {
            let text = format!("{}<{}", letter.repeat(5000), letter.repeat(5000));
            let index = Index::of(text.as_bytes());
            let part = index.part(&text, 5001);
            assert_eq!(part.skipped, 4001);
            assert_eq!(part.text.chars().count(), 2 * REACH);
            assert_eq!(part.text.chars().nth(999), Some('<'));
            assert!(part.goes_on);
            let end = index.part(&text, u64::MAX);
            assert_eq!((end.text.as_str(), end.goes_on), ("", false));
        }
    }

    #[test]
    fn damaged_image_gives_no_lines() {
        let sources = ImageSources::new(vec![0_u8; 100], "a.xodr");
        assert_eq!(sources.answer("a.xodr", 1, 1), Answer::OtherFile);
    }
}

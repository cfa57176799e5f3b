//! Files of an image, and places in them.

/// A file whose bytes are part of the image's text: the root file, or one that it includes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Source<'a> {
    /// Its path, as given by ingest.
    pub path: &'a str,
    /// Offset of its first byte in the image's text.
    pub start: u32,
    /// Its length in bytes (of the UTF-8 text, when it was transcoded).
    pub len: u32,
}

/// A place in a file, in the form that people and editors use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Position<'a> {
    /// The file.
    pub path: &'a str,
    /// The line, counted from 1 by line feeds.
    pub row: u32,
    /// The character within the line, counted from 1; a byte order mark does not count.
    pub column: u32,
    /// Bytes from the start of that file (of its UTF-8 text, when it was transcoded).
    pub offset: u32,
    /// Whether the file is the root file and not an included one.
    pub is_root_file: bool,
}

impl std::fmt::Display for Position<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}:{}", self.path, self.row, self.column)
    }
}

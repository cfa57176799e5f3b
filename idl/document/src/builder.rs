//! Writes an image into a buffer of the caller, in one pass over the events of a parser.
//!
//! The caller first counts upper bounds ([`Capacities`]), borrows that many bytes and passes the
//! events. Each section grows at the offset that it has in an image of full capacity. Then
//! [`ImageBuilder::finish`] moves the sections together. Each section moves at most once and only
//! downwards, and the text never moves.

mod capacities;
mod finish;
mod grow;
mod names;

use thiserror::Error;

use crate::fault::FaultCode;
use crate::layout::{
    AttributeRecord, ELEMENT, FaultRecord, NodeRecord, RESOLVED_TEXT, SECTIONS, Section,
    SourceRecord, TEXT, U16, U32,
};
pub use capacities::Capacities;
use names::Names;

/// Reason why an image cannot be built.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum BuildError {
    /// The number of items exceeds its capacity.
    #[error("build the document image: there is no room for more than {capacity} {what}")]
    NoRoom {
        /// The kind of item.
        what: &'static str,
        /// Maximum number of items (or bytes).
        capacity: usize,
    },
    /// The buffer is smaller than [`Capacities::image_len`].
    #[error("build the document image: the buffer has {found} bytes, {needed} are needed")]
    SmallBuffer {
        /// Its length.
        found: usize,
        /// Required length according to the capacities.
        needed: usize,
    },
    /// The text or the nodes exceed 4 GiB.
    #[error("build the document image: {what} do not fit into 32 bits")]
    TooLarge {
        /// The kind of item.
        what: &'static str,
    },
    /// The number of distinct names exceeds [`Capacities::MAX_NAMES`].
    #[error(
        "build the document image: more than {} distinct names",
        Capacities::MAX_NAMES
    )]
    TooManyNames,
    /// A range is outside of the text written so far.
    #[error("build the document image: {offset} + {len} is outside the text")]
    OutsideText {
        /// Its offset.
        offset: u32,
        /// Its length.
        len: u32,
    },
    /// An event is invalid at this point, such as an end without a start or a second root.
    #[error("build the document image: {event} is not allowed here")]
    Misplaced {
        /// The event.
        event: &'static str,
    },
}

/// Builds an image. The methods describe the accepted events.
pub struct ImageBuilder<'out> {
    out: &'out mut [u8],
    /// Offset and maximum length of each section of a full image.
    places: [usize; SECTIONS],
    limits: [usize; SECTIONS],
    /// Bytes used of each section.
    used: [usize; SECTIONS],
    names: Names,
    /// Elements not yet closed, outermost first.
    open: Vec<u32>,
    /// Whether the last opened element still accepts attributes.
    taking_attributes: bool,
}

impl<'out> ImageBuilder<'out> {
    /// Starts an image in `out`. The current content of `out` does not matter.
    ///
    /// # Errors
    /// Fails if `out` is shorter than [`Capacities::image_len`].
    pub fn new(out: &'out mut [u8], capacities: &Capacities) -> Result<Self, BuildError> {
        let needed = capacities.image_len();
        let found = out.len();
        let out = out
            .get_mut(..needed)
            .ok_or(BuildError::SmallBuffer { found, needed })?;
        let (places, limits) = capacities.places();
        Ok(ImageBuilder {
            out,
            places,
            limits,
            used: [0; SECTIONS],
            names: Names::new(capacities.names),
            open: Vec::new(),
            taking_attributes: false,
        })
    }

    /// Appends the whole text of a file and returns the offset of its first byte. The document is
    /// named after the first file. The text of an include must precede its first node.
    ///
    /// # Errors
    /// Fails if the capacity of text, sources or heap is exceeded.
    pub fn source(&mut self, path: &str, text: &str) -> Result<u32, BuildError> {
        // With the gap, the position just past the end of a file is not part of the next one.
        let gap: &[u8] = if self.used[Section::Sources as usize] > 0 {
            b"\n"
        } else {
            b""
        };
        // Everything is checked first: the text of a partial source would belong to no file.
        self.room(Section::Text, gap.len() + text.len())?;
        self.room(Section::Heap, path.len())?;
        self.room(Section::Sources, size_of::<SourceRecord>())?;
        length(path, "a path")?;
        narrow(
            self.used[Section::Text as usize] + gap.len() + text.len(),
            "bytes of text",
        )?;
        self.append(Section::Text, gap)?;
        let start = self.append(Section::Text, text.as_bytes())?;
        let path_offset = self.append(Section::Heap, path.as_bytes())?;
        let record = SourceRecord {
            path_offset: U32::new(path_offset),
            path_len: U32::new(length(path, "a path")?),
            start: U32::new(start),
            len: U32::new(length(text, "bytes of text")?),
        };
        self.append(Section::Sources, bytemuck::bytes_of(&record))?;
        Ok(start)
    }

    /// Opens an element. `name` is as written with its prefix, `offset` is that of its `<`.
    ///
    /// # Errors
    /// Fails if a capacity is exceeded, or if the root element is already closed.
    pub fn open_element(&mut self, name: &str, offset: u32) -> Result<(), BuildError> {
        if self.open.is_empty() && self.used[Section::Nodes as usize] > 0 {
            return Err(BuildError::Misplaced {
                event: "a second root element",
            });
        }
        let local = local_name(name);
        let written_at = offset
            .saturating_add(1)
            .saturating_add(length(name, "a name")? - length(local, "a name")?);
        let id = self.name(local, written_at)?;
        let index = self.push_node(offset, offset, id, ELEMENT)?;
        self.names.count_element(id);
        self.open.push(index);
        self.taking_attributes = true;
        Ok(())
    }

    /// Adds an attribute to the element just opened; `name` is as written. `value` is the value
    /// resolved by the parser, or `None` if it equals the `value_len` bytes at `value_offset`.
    ///
    /// # Errors
    /// Fails if a capacity is exceeded, the range is outside of the text, or a child precedes it.
    pub fn attribute(
        &mut self,
        name: &str,
        name_offset: u32,
        value_offset: u32,
        value_len: u32,
        value: Option<&str>,
    ) -> Result<(), BuildError> {
        if !self.taking_attributes {
            return Err(BuildError::Misplaced {
                event: "an attribute",
            });
        }
        self.check_range(name_offset, 0)?;
        self.check_range(value_offset, value_len)?;
        let id = self.name(name, name_offset)?;
        let delta = value_offset
            .checked_sub(name_offset)
            .and_then(|delta| u16::try_from(delta).ok());
        let (delta, len) = match (value, delta) {
            (None, Some(delta)) if delta > 0 => (delta, value_len),
            (value, _) => (0, self.push_resolved(value_offset, value_len, value)?),
        };
        let record = AttributeRecord {
            offset: U32::new(name_offset),
            name: U16::new(id),
            value_delta: U16::new(delta),
            value_len: U32::new(len),
        };
        self.append(Section::Attributes, bytemuck::bytes_of(&record))
            .map(drop)
    }

    /// Adds character data from `start` to `stop`. `value` is the value resolved by the parser, or
    /// `None` if it equals those bytes. Pure white space is skipped.
    ///
    /// # Errors
    /// Fails if a capacity is exceeded, the range is outside of the text, or no element is open.
    pub fn text(&mut self, start: u32, stop: u32, value: Option<&str>) -> Result<(), BuildError> {
        let len = stop.checked_sub(start).ok_or(BuildError::OutsideText {
            offset: start,
            len: 0,
        })?;
        self.check_range(start, len)?;
        let blank = |text: &[u8]| {
            text.iter()
                .all(|byte| matches!(byte, b' ' | b'\t' | b'\n' | b'\r'))
        };
        let literal = self.text_bytes(start, len);
        // The literal text is checked, because `&#32;` is intentional white space.
        if blank(literal) {
            return Ok(());
        }
        self.character_data(start, len, value)
    }

    /// Adds the content of a CDATA section from `start` to `stop`; `value` is as for
    /// [`text`](ImageBuilder::text). White space is kept.
    ///
    /// # Errors
    /// Fails as [`text`](ImageBuilder::text) does.
    pub fn cdata(&mut self, start: u32, stop: u32, value: Option<&str>) -> Result<(), BuildError> {
        let len = stop.checked_sub(start).ok_or(BuildError::OutsideText {
            offset: start,
            len: 0,
        })?;
        self.check_range(start, len)?;
        self.character_data(start, len, value)
    }

    fn character_data(
        &mut self,
        start: u32,
        len: u32,
        value: Option<&str>,
    ) -> Result<(), BuildError> {
        if self.open.is_empty() {
            return Err(BuildError::Misplaced {
                event: "character data",
            });
        }
        let (stop, kind) = match value {
            None => (start + len, TEXT),
            Some(value) => (self.push_resolved(start, len, Some(value))?, RESOLVED_TEXT),
        };
        self.push_node(start, stop, 0, kind)?;
        self.taking_attributes = false;
        Ok(())
    }

    /// Closes the innermost open element; `end` is one past the `>` that ends it.
    ///
    /// # Errors
    /// Fails if no element is open, or if `end` is outside of the text.
    pub fn close_element(&mut self, end: u32) -> Result<(), BuildError> {
        self.check_range(end, 0)?;
        let index = self.open.pop().ok_or(BuildError::Misplaced {
            event: "the end of an element",
        })?;
        self.taking_attributes = false;
        let behind = self.nodes();
        let node: &mut NodeRecord = self.record_mut(Section::Nodes, index)?;
        node.stop = U32::new(end);
        node.end = U32::new(behind);
        Ok(())
    }

    /// Adds a fault of the file at `offset` of the text (beyond the end means the end).
    ///
    /// # Errors
    /// Fails if the capacity of faults or heap is exceeded.
    pub fn fault(&mut self, code: FaultCode, offset: u32, text: &str) -> Result<(), BuildError> {
        self.room(Section::Faults, size_of::<FaultRecord>())?;
        let text_offset = self.append(Section::Heap, text.as_bytes())?;
        let record = FaultRecord {
            code: U32::new(code.number()),
            offset: U32::new(offset.min(self.text_len())),
            text_offset: U32::new(text_offset),
            text_len: U32::new(length(text, "a fault's text")?),
        };
        self.append(Section::Faults, bytemuck::bytes_of(&record))
            .map(drop)
    }

    /// Returns the number of open elements.
    pub fn depth(&self) -> usize {
        self.open.len()
    }
}

/// Returns the part of a name after the first colon, or the whole name if it has no prefix.
#[inline]
pub(crate) fn local_name(name: &str) -> &str {
    // Few names have a prefix, and all names are short.
    if !name.bytes().any(|byte| byte == b':') {
        return name;
    }
    match name.split_once(':') {
        Some((prefix, local)) if !prefix.is_empty() && !local.is_empty() => local,
        _ => name,
    }
}

fn length(text: &str, what: &'static str) -> Result<u32, BuildError> {
    narrow(text.len(), what)
}

fn narrow(number: usize, what: &'static str) -> Result<u32, BuildError> {
    u32::try_from(number).map_err(|_| BuildError::TooLarge { what })
}

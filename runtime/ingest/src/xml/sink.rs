//! Receives the events of a parse: either in the image, or in a counter that computes its size.

use qcbus_document::{BuildError, Capacities, ImageBuilder};

/// Reason why a sink accepts no further events.
#[derive(Debug)]
pub(crate) enum Halt {
    /// The builder returned an error.
    Build(BuildError),
    /// The counted image became larger than allowed. The value is its size so far.
    TooLarge(usize),
}

impl From<BuildError> for Halt {
    fn from(error: BuildError) -> Halt {
        Halt::Build(error)
    }
}

/// Receives the events of a parse. Offsets refer to the image's text.
pub(crate) trait Sink {
    fn open(&mut self, name: &str, offset: u32) -> Result<(), Halt>;
    /// Adds an attribute. `resolved` is the value if it differs from the raw text.
    fn attribute(
        &mut self,
        name: &str,
        name_at: u32,
        value_at: u32,
        value_len: u32,
        resolved: Option<&str>,
    ) -> Result<(), Halt>;
    fn text(&mut self, start: u32, stop: u32, resolved: Option<&str>) -> Result<(), Halt>;
    fn close(&mut self, stop: u32) -> Result<(), Halt>;
}

impl Sink for ImageBuilder<'_> {
    #[inline]
    fn open(&mut self, name: &str, offset: u32) -> Result<(), Halt> {
        Ok(self.open_element(name, offset)?)
    }

    #[inline]
    fn attribute(
        &mut self,
        name: &str,
        name_at: u32,
        value_at: u32,
        value_len: u32,
        resolved: Option<&str>,
    ) -> Result<(), Halt> {
        Ok(ImageBuilder::attribute(
            self, name, name_at, value_at, value_len, resolved,
        )?)
    }

    fn text(&mut self, start: u32, stop: u32, resolved: Option<&str>) -> Result<(), Halt> {
        // Blank text has already been dropped. The remaining text must stay, even `&#32;`.
        Ok(self.cdata(start, stop, resolved)?)
    }

    #[inline]
    fn close(&mut self, stop: u32) -> Result<(), Halt> {
        Ok(self.close_element(stop)?)
    }
}

/// Counts the content of an image, and stops at the maximum size.
pub(crate) struct Counter {
    pub counted: Capacities,
    max_image: usize,
}

impl Counter {
    /// Starts with the values known before the parse: text, sources, faults and their heap.
    pub fn new(known: Capacities, max_image: usize) -> Counter {
        Counter {
            counted: known,
            max_image,
        }
    }

    fn check(&self) -> Result<(), Halt> {
        // The sum is expensive, and a check at every 4096th event is enough for a cap.
        if !(self.counted.nodes + self.counted.attributes).is_multiple_of(4096) {
            return Ok(());
        }
        let len = self.counted.image_len();
        if len > self.max_image {
            Err(Halt::TooLarge(len))
        } else {
            Ok(())
        }
    }

    fn heap(&mut self, len: usize) {
        self.counted.heap += Capacities::PER_RESOLVED + len;
    }

    fn name(&mut self) {
        self.counted.names = (self.counted.names + 1).min(Capacities::MAX_NAMES);
    }
}

impl Sink for Counter {
    fn open(&mut self, _name: &str, _offset: u32) -> Result<(), Halt> {
        self.counted.nodes += 1;
        self.name();
        self.check()
    }

    fn attribute(
        &mut self,
        _name: &str,
        name_at: u32,
        value_at: u32,
        value_len: u32,
        resolved: Option<&str>,
    ) -> Result<(), Halt> {
        self.counted.attributes += 1;
        self.name();
        match resolved {
            Some(value) => self.heap(value.len()),
            // The distance between name and value is too large for 16 bits, so the builder copies
            // the value.
            None if value_at - name_at > u32::from(u16::MAX) => self.heap(value_len as usize),
            None => {}
        }
        self.check()
    }

    fn text(&mut self, _start: u32, _stop: u32, resolved: Option<&str>) -> Result<(), Halt> {
        self.counted.nodes += 1;
        if let Some(value) = resolved {
            self.heap(value.len());
        }
        self.check()
    }

    fn close(&mut self, _stop: u32) -> Result<(), Halt> {
        Ok(())
    }
}

//! Who takes the events of a parse: the image, or a counter that finds out how large it will be.

use qcbus_document::{BuildError, Capacities, ImageBuilder};

/// Why a sink takes no more.
#[derive(Debug)]
pub(crate) enum Halt {
    /// The builder refused.
    Build(BuildError),
    /// A counted image became larger than allowed; its size so far.
    TooLarge(usize),
}

impl From<BuildError> for Halt {
    fn from(error: BuildError) -> Halt {
        Halt::Build(error)
    }
}

/// Takes the events of a parse; offsets are those of the image's text.
pub(crate) trait Sink {
    fn open(&mut self, name: &str, offset: u32) -> Result<(), Halt>;
    /// `resolved` is the value where it differs from the raw text.
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
        // Ingest has dropped what is blank; what is left is wanted, be it `&#32;`.
        Ok(self.cdata(start, stop, resolved)?)
    }

    #[inline]
    fn close(&mut self, stop: u32) -> Result<(), Halt> {
        Ok(self.close_element(stop)?)
    }
}

/// Counts what an image will hold, and stops when that is too much.
pub(crate) struct Counter {
    pub counted: Capacities,
    max_image: usize,
}

impl Counter {
    /// Starts from what is known before the parse: text, sources, faults and their heap.
    pub fn new(known: Capacities, max_image: usize) -> Counter {
        Counter {
            counted: known,
            max_image,
        }
    }

    fn check(&self) -> Result<(), Halt> {
        // Adding up is dear; every 4096th event is often enough for a cap.
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
            // Too far from its name for a short distance: the builder copies it.
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

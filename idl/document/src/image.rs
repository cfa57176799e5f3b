//! An image that owns its bytes.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use crate::{Document, ImageError};

/// The bytes of an image, in any kind of memory. They stay readable as long as any clone lives. Use
/// it to keep results made from a document after the document is returned.
#[derive(Clone)]
pub struct Image(Arc<dyn AsRef<[u8]> + Send + Sync>);

impl Image {
    /// Creates an image from these bytes, which may lie in shared memory.
    pub fn new(bytes: impl AsRef<[u8]> + Send + Sync + 'static) -> Image {
        Image(Arc::new(bytes))
    }

    /// Returns the document, which is read in place.
    ///
    /// # Errors
    /// The errors of [`Document::open`].
    pub fn document(&self) -> Result<Document<'_>, ImageError> {
        Document::open(self)
    }
}

impl Deref for Image {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        (*self.0).as_ref()
    }
}

impl fmt::Debug for Image {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Image").field("len", &self.len()).finish()
    }
}

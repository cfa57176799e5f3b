//! An image that somebody owns.

use std::fmt;
use std::ops::Deref;
use std::sync::Arc;

use crate::{Document, ImageError};

/// The bytes of an image, wherever they are: they stay readable as long as any clone lives. For
/// those who keep what they made of a document longer than they were given it.
#[derive(Clone)]
pub struct Image(Arc<dyn AsRef<[u8]> + Send + Sync>);

impl Image {
    /// An image in these bytes, which may be held in shared memory.
    pub fn new(bytes: impl AsRef<[u8]> + Send + Sync + 'static) -> Image {
        Image(Arc::new(bytes))
    }

    /// The document, read in place.
    ///
    /// # Errors
    /// As [`Document::open`].
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

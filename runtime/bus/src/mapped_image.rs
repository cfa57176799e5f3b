//! Zero-copy access to published document images.

use std::fmt;
use std::ops::Deref;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use bytemuck::{Pod, Zeroable};
use iceoryx2::prelude::*;
use iceoryx2::sample::Sample;
use qcbus_document::FileKind;
use qcbus_messages::services::BLOCK_BYTES;
use qcbus_messages::{Digest, DocId};

use crate::ports::Service;

/// Unit in which images are lent: a cache line. If iceoryx2 got the alignment of `[u8]` instead,
/// every slot would be 64 times larger.
#[derive(Debug, Clone, Copy, Pod, Zeroable, ZeroCopySend)]
#[type_name("qcbus.Block.1")]
#[repr(C)]
#[repr(align(64))]
pub(crate) struct Block([u8; BLOCK_BYTES]);

/// Header of every image.
#[derive(Debug, Clone, Copy, Default, ZeroCopySend)]
#[type_name("qcbus.DocumentHeader.1")]
#[repr(C)]
pub(crate) struct DocumentHeader {
    pub(crate) generation: u64,
    pub(crate) doc: u64,
    /// Size of the image in bytes. The rest of the last block is padding.
    pub(crate) used: u64,
    pub(crate) digest: [u8; 32],
    pub(crate) kind: u32,
    pub(crate) reserved: u32,
}

/// Value that stands for no document: the broker needs shared memory back. Peers must release the
/// documents that they have finished with.
pub(crate) const LET_GO: u64 = u64::MAX;

pub(crate) fn kind_code(kind: FileKind) -> u32 {
    match kind {
        FileKind::Xodr => 1,
        FileKind::Xosc => 2,
        FileKind::Mosc => 3,
    }
}

fn kind_of_code(code: u32) -> Option<FileKind> {
    FileKind::ALL
        .into_iter()
        .find(|kind| kind_code(*kind) == code)
}

pub(crate) type DocumentSample = Sample<Service, [Block], DocumentHeader>;

/// A counted hold. The number of holds is limited.
#[derive(Debug)]
pub(crate) struct ImageUse(Arc<AtomicUsize>);

impl ImageUse {
    /// Takes one item, or returns `None` if `limit` items are already taken.
    pub(crate) fn take(counter: &Arc<AtomicUsize>, limit: usize) -> Option<ImageUse> {
        counter
            .fetch_update(Ordering::AcqRel, Ordering::Acquire, |out| {
                (out < limit).then_some(out + 1)
            })
            .ok()
            .map(|_| ImageUse(Arc::clone(counter)))
    }
}

impl Drop for ImageUse {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

/// A mapping of shared memory with its metadata.
struct Mapped {
    start: *const u8,
    len: usize,
    generation: u64,
    doc: DocId,
    digest: Digest,
    kind: FileKind,
    // Keeps the mapping and the slot. It precedes the counter, so the slot is returned first.
    _sample: Mutex<DocumentSample>,
    _image_use: ImageUse,
}

#[expect(
    unsafe_code,
    reason = "a type with a raw pointer is neither Send nor Sync by default"
)]
// SAFETY: `start` points into the mapping that `_sample` keeps, which may be read from any thread.
// The content does not change (see `MappedImage::deref`). The sample itself is Send and only
// accessed when it is dropped.
unsafe impl Send for Mapped {}
#[expect(unsafe_code, reason = "see above")]
// SAFETY: as above; shared access only reads immutable memory.
unsafe impl Sync for Mapped {}

/// A published image, read in place. It stays readable as long as any clone exists, even after the
/// broker has ended.
#[derive(Clone)]
pub struct MappedImage(Arc<Mapped>);

impl MappedImage {
    /// Wraps a sample, or returns `None` if its header is invalid.
    pub(crate) fn new(
        sample: DocumentSample,
        generation: u64,
        image_use: ImageUse,
    ) -> Option<MappedImage> {
        let header = *sample.user_header();
        let bytes: &[u8] = bytemuck::cast_slice(sample.payload());
        let len = usize::try_from(header.used).ok()?;
        if len > bytes.len() || header.generation != generation {
            return None;
        }
        Some(MappedImage(Arc::new(Mapped {
            start: bytes.as_ptr(),
            len,
            generation,
            doc: DocId(header.doc),
            digest: Digest(header.digest),
            kind: kind_of_code(header.kind)?,
            _sample: Mutex::new(sample),
            _image_use: image_use,
        })))
    }

    /// Returns the number of the document.
    pub fn doc(&self) -> DocId {
        self.0.doc
    }

    /// Returns the generation and the number, which identify the image among all that brokers of
    /// this instance ever published. The bytes behind it never change. A document gets a new
    /// identity as soon as a byte of it, or of a file that it includes, changes.
    pub fn identity(&self) -> (u64, DocId) {
        (self.0.generation, self.0.doc)
    }

    /// Returns the digest under which it was published: that of its file, without included files.
    pub fn digest(&self) -> Digest {
        self.0.digest
    }

    /// Returns the kind of file it was made from.
    pub fn kind(&self) -> FileKind {
        self.0.kind
    }

    /// Checks whether no other code in this process holds it.
    pub(crate) fn is_unused(&self) -> bool {
        Arc::strong_count(&self.0) == 1
    }
}

impl Deref for MappedImage {
    type Target = [u8];

    #[expect(
        unsafe_code,
        reason = "the image is read in place, in memory that Rust does not own"
    )]
    fn deref(&self) -> &[u8] {
        // SAFETY: `start` and `len` were taken from the sample's payload, within its bounds, and
        // the mapping lives as long as `self.0`. A slice must not change while it is borrowed:
        // - this process cannot write there, because subscribers map the segment read-only;
        // - the broker, which publishes, lends a slot again only after every hold of it was
        //   returned;
        // - other users cannot open the segment: it is 0600, in a directory that is 0700;
        // - other bundles cannot open it for writing once they are confined. An unconfined program
        //   of the same user remains. It could also write into the memory of this process itself,
        //   so there is no guarantee against it. A text that it changes while borrowed may be an
        //   invalid `str`. Any other change leads to wrong or missing values
        //   (`a_slot_that_is_rewritten_while_it_is_read` in `tests/bus/privacy.rs`), because the
        //   accessors of `qcbus_document` check everything on use.
        unsafe { std::slice::from_raw_parts(self.0.start, self.0.len) }
    }
}

impl AsRef<[u8]> for MappedImage {
    fn as_ref(&self) -> &[u8] {
        self
    }
}

impl fmt::Debug for MappedImage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Held")
            .field("doc", &self.0.doc)
            .field("kind", &self.0.kind)
            .field("len", &self.0.len)
            .finish()
    }
}

//! The broker's side of the document topics: lends slots, publishes images and holds them.

use std::collections::BTreeMap;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard};

use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::sample_mut::SampleMut;
use qcbus_document::FileKind;
use qcbus_messages::services::{BLOCK_BYTES, Topic};
use qcbus_messages::{Digest, DocId};
use tokio::sync::Notify;

use crate::mapped_image::{Block, DocumentHeader, ImageUse, LET_GO, MappedImage, kind_code};
use crate::memory::{RoomLocks, SharedMemory, free_shared_memory};
use crate::pages::{back_with_memory, take_memory_from};
use crate::ports::{self, Hub, PortError, Pub, Service, Sub, TopicService};

/// Maximum size of an image in bytes: offsets within an image are 32 bits wide.
const MAX_IMAGE: usize = u32::MAX as usize;

/// Reason why no slot is lent.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum LoanError {
    /// Shared memory lacks room. Writing anyway would kill the process, so no slot is lent.
    #[error(
        "not enough shared memory: {needed} bytes are needed, but not free in /dev/shm; it has {size} bytes, of \
         which {reserve} are kept in reserve; free some memory in it or make it larger"
    )]
    NoSpace {
        /// Requested bytes.
        needed: u64,
        /// Size of /dev/shm in bytes.
        size: u64,
        /// Bytes that must stay free.
        reserve: u64,
    },
    /// Shared memory is too small, even if all of it were released.
    #[error(
        "{needed} bytes of shared memory are needed, but /dev/shm has only {size} in total, of which {kept} are \
         reserved for the bus itself; make it larger: `mount -o remount,size={advised}M /dev/shm`, for a \
         container `docker run --shm-size={advised}m`"
    )]
    NeverFits {
        /// Requested bytes.
        needed: u64,
        /// Size of /dev/shm in bytes.
        size: u64,
        /// Bytes of /dev/shm that documents cannot use.
        kept: u64,
        /// A sufficient size in MiB.
        advised: u64,
    },
    /// The address space limit of the process is too small for the mapping.
    #[error(
        "the address space of a process is limited to {limit} bytes here (`ulimit -v`), which is too little to \
         map shared memory for {needed} bytes; raise it with `ulimit -v unlimited`"
    )]
    AddressSpace {
        /// Requested bytes.
        needed: u64,
        /// The limit in bytes.
        limit: u64,
    },
    /// The image exceeds the maximum size.
    #[error("an image of {0} bytes exceeds the maximum size")]
    TooLarge(usize),
    /// The maximum number of documents is being filled or held. Release some documents first.
    #[error("the maximum number of documents on the bus is in use")]
    Busy,
    /// The bus refuses, with this error text.
    #[error("the bus refused: {0}")]
    Bus(String),
}

/// Reason why an image cannot be published.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PublishError {
    /// The number of used bytes exceeds the number of lent bytes.
    #[error("{used} bytes are used, but only {lent} are lent")]
    TooMuchUsed {
        /// Used bytes, as stated by the caller.
        used: usize,
        /// Lent bytes.
        lent: usize,
    },
    /// The bus refuses, with this error text.
    #[error("the bus refused: {0}")]
    Bus(String),
}

/// One size class.
struct Class {
    row: Topic,
    _service: TopicService<Block, DocumentHeader>,
    publisher: RwLock<Pub<Block, DocumentHeader>>,
    /// Slots that were written since their memory was released: start address and maximum number of
    /// bytes written.
    slots: Mutex<BTreeMap<usize, usize>>,
    /// Whether an image was published since the publisher was created.
    used: AtomicBool,
    /// The broker's own subscriber, through which it holds its published images. The lock is kept
    /// from sending to receiving, so that the received image is the sent one.
    own: Mutex<Sub<Block, DocumentHeader>>,
    mapped_image: Arc<AtomicUsize>,
    lent: Arc<AtomicUsize>,
}

impl Class {
    fn new(hub: &Hub, row: Topic) -> Result<Class, PortError> {
        let service = hub.topic::<Block, DocumentHeader>(&row, "")?;
        let own = ports::subscriber(&service, &row)?;
        Ok(Class {
            publisher: RwLock::new(ports::publisher(&service, &row, row.slots())?),
            slots: Mutex::default(),
            _service: service,
            used: AtomicBool::new(false),
            own: Mutex::new(own),
            row,
            mapped_image: Arc::default(),
            lent: Arc::default(),
        })
    }

    /// Returns the bytes of shared memory that may be needed to push all documents out of the
    /// history. The header of a slot and its first block may lie on different pages.
    fn letting_go_bytes(&self) -> u64 {
        let slots = self.row.history.max(self.row.buffer);
        (2 * rustix::param::page_size() * slots) as u64
    }

    /// Releases the memory of every slot that is not in use. Otherwise a small /dev/shm would stay
    /// full of unneeded documents, because only publishing pushes them out of the history. The
    /// caller must hold a loan permit. The function does nothing while others hold one.
    ///
    /// The publisher stays the same because a confined peer cannot connect to another one.
    fn empty(&self, shared: &Shared) {
        let _lock = shared.room_locks.take();
        let Some(_open) = shared.open() else {
            return;
        };
        let publisher = self
            .publisher
            .write()
            .unwrap_or_else(PoisonError::into_inner);
        if self.lent.load(Ordering::Acquire) != 1 {
            return;
        }
        // Lending a slot writes to its header. If other processes have filled the memory to the
        // last page, that write would kill the process. Their memory cannot be released here.
        if free_shared_memory() < self.letting_go_bytes() {
            return;
        }
        if self.used.swap(false, Ordering::AcqRel) {
            self.push_everything_out(&publisher);
        }
        let mut used = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let mut free = Vec::new();
        // The last released slot is lent first, so the slots that were never used come last.
        for _ in 0..used.len() {
            let Ok(mut sample) = publisher.loan_slice_uninit(1) else {
                break;
            };
            let start = sample.payload_mut().as_mut_ptr();
            let Some(len) = used.remove(&start.addr()) else {
                break;
            };
            take_memory_from(start.cast(), len);
            free.push(sample);
        }
    }

    fn remember(&self, slot: &mut [std::mem::MaybeUninit<Block>]) {
        let mut slots = self.slots.lock().unwrap_or_else(PoisonError::into_inner);
        let longest = slots.entry(slot.as_mut_ptr().addr()).or_default();
        *longest = size_of_val(slot).max(*longest);
    }

    /// Replaces the content of the history and of all subscriber buffers with release requests.
    fn push_everything_out(&self, publisher: &Pub<Block, DocumentHeader>) {
        let own = self.own.lock().unwrap_or_else(PoisonError::into_inner);
        for _ in 0..self.row.history.max(self.row.buffer) {
            if let Ok(mut sample) = publisher.loan_slice_uninit(1) {
                sample.user_header_mut().doc = LET_GO;
                let sent = initialised(sample).send();
                tracing::trace!(
                    ?sent,
                    topic = self.row.name,
                    "requested the release of shared memory"
                );
            }
        }
        while let Ok(Some(_)) = own.receive() {}
    }
}

struct Shared {
    generation: u64,
    classes: [Class; 2],
    reserve: u64,
    /// Bytes that the bus itself needs.
    own: u64,
    room_locks: RoomLocks,
    /// Whether lending and publishing has stopped. Code that may create files of the bus holds the
    /// read lock meanwhile. A file created after the removal would stay.
    stopped: RwLock<bool>,
    /// Tells the broker's loop that peers wait for a document.
    again: Notify,
}

impl Shared {
    /// Returns a guard that prevents stopping, or `None` if lending has already stopped.
    fn open(&self) -> Option<RwLockReadGuard<'_, bool>> {
        let stopped = self.stopped.read().unwrap_or_else(PoisonError::into_inner);
        (!*stopped).then_some(stopped)
    }
}

fn has_stopped() -> LoanError {
    LoanError::Bus("the broker has stopped".to_owned())
}

/// Lends slots for document images and publishes them. Cheap to clone; intended for worker threads.
#[derive(Clone)]
pub struct Documents {
    shared: Arc<Shared>,
}

impl Documents {
    pub(crate) fn new(
        hub: &Hub,
        generation: u64,
        rows: [Topic; 2],
        reserve: u64,
        own: u64,
    ) -> Result<Documents, PortError> {
        let [small, large] = rows;
        let shared = Shared {
            generation,
            classes: [Class::new(hub, small)?, Class::new(hub, large)?],
            reserve,
            own,
            room_locks: RoomLocks::new(),
            stopped: RwLock::new(false),
            again: Notify::new(),
        };
        Ok(Documents {
            shared: Arc::new(shared),
        })
    }

    /// Returns the maximum number of bytes of shared memory that slots use.
    pub(crate) fn bytes(&self) -> usize {
        let of = |class: &Class| -> usize {
            let slots = class.slots.lock().unwrap_or_else(PoisonError::into_inner);
            slots.values().sum()
        };
        self.shared.classes.iter().map(of).sum()
    }

    /// Lends at least `len` bytes. Their content is undefined, so write before you read. All of it
    /// is backed by memory when this returns, so writing cannot fail.
    ///
    /// # Errors
    /// See [`LoanError`].
    pub fn loan(&self, len: usize) -> Result<Loan, LoanError> {
        // A slow subscriber would lose documents beyond the size of its buffer.
        self.lend(len, |row| row.buffer)
    }

    fn lend(&self, len: usize, most_held: impl FnOnce(&Topic) -> usize) -> Result<Loan, LoanError> {
        if len > MAX_IMAGE {
            return Err(LoanError::TooLarge(len));
        }
        let index = usize::from(len > self.shared.classes[0].row.slot_bytes());
        let class = &self.shared.classes[index];
        let mapped_image =
            ImageUse::take(&class.mapped_image, most_held(&class.row)).ok_or(LoanError::Busy)?;
        let lent = ImageUse::take(&class.lent, class.row.loans).ok_or(LoanError::Busy)?;
        let blocks = len.div_ceil(BLOCK_BYTES).max(1);
        let bytes = (blocks * BLOCK_BYTES) as u64;
        let sample = self.take(class, blocks, bytes).or_else(|error| {
            if !matches!(error, LoanError::NoSpace { .. }) {
                return Err(error);
            }
            // Memory of both classes is released, because one may occupy what the other needs.
            self.give_back(index);
            self.take(class, blocks, bytes)
        })?;
        Ok(Loan {
            sample: initialised(sample),
            class: index,
            len,
            mapped_image,
            _lent: lent,
            documents: self.clone(),
        })
    }

    /// Takes a slot and all the memory that it needs.
    fn take(&self, class: &Class, blocks: usize, bytes: u64) -> Result<Uninit, LoanError> {
        let _lock = self.shared.room_locks.take();
        self.look_for(bytes)?;
        let open = self.shared.open().ok_or_else(has_stopped)?;
        let publisher = class
            .publisher
            .read()
            .unwrap_or_else(PoisonError::into_inner);
        let mut sample = publisher
            .loan_slice_uninit(blocks)
            .map_err(|why| match why {
                iceoryx2::port::LoanError::ExceedsMaxLoans => LoanError::Busy,
                // All slots are in use, or larger ones cannot be mapped.
                iceoryx2::port::LoanError::OutOfMemory => {
                    let grows = bytes > class.row.slot_bytes() as u64;
                    let limited = || limited_addresses(bytes);
                    grows.then(limited).flatten().unwrap_or(LoanError::Busy)
                }
                other => limited_addresses(bytes).unwrap_or(LoanError::Bus(format!("{other:?}"))),
            })?;
        drop(publisher);
        drop(open);
        class.remember(sample.payload_mut());
        match back_with_memory(sample.payload_mut()) {
            Ok(()) => Ok(sample),
            Err(()) => Err(self.no_space(bytes)),
        }
    }

    /// Checks whether enough memory is free besides the reserve.
    fn look_for(&self, needed: u64) -> Result<(), LoanError> {
        let Ok(memory) = SharedMemory::now() else {
            return Err(self.no_space(needed));
        };
        let kept = self.shared.reserve.saturating_add(self.shared.own);
        let whole = needed.saturating_add(kept);
        // A size of 0 means that the memory has no limit.
        if memory.size > 0 && memory.size < whole {
            return Err(LoanError::NeverFits {
                needed,
                size: memory.size,
                kept,
                advised: whole.saturating_mul(2).div_ceil(1 << 20),
            });
        }
        let enough = memory.free >= needed.saturating_add(self.shared.reserve);
        match enough || memory.size == 0 {
            true => Ok(()),
            false => Err(self.no_space(needed)),
        }
    }

    fn no_space(&self, needed: u64) -> LoanError {
        LoanError::NoSpace {
            needed,
            size: SharedMemory::now().map_or(0, |memory| memory.size),
            reserve: self.shared.reserve,
        }
    }

    /// Publishes a held image again, for a peer that reports it as missing. The bytes are copied
    /// into a new slot, because a slot held by others cannot be sent again.
    ///
    /// # Errors
    /// See [`LoanError`].
    pub fn publish_again(&self, mapped_image: &MappedImage) -> Result<(), LoanError> {
        // This is in addition to the documents of all jobs. The limit is one below that of a
        // subscriber, because receiving needs a free permit.
        let mut loan = self.lend(mapped_image.len(), |row| row.borrowed - 1)?;
        loan.copy_from_slice(mapped_image);
        loan.publish(
            mapped_image.doc(),
            mapped_image.len(),
            mapped_image.digest(),
            mapped_image.kind(),
        )
        .map_err(|error| LoanError::Bus(error.to_string()))?;
        self.shared.again.notify_one();
        Ok(())
    }

    /// Waits until a document was published for peers that wait for it. Cancel-safe.
    pub(crate) async fn published_again(&self) {
        self.shared.again.notified().await;
    }

    /// Connects new subscribers. They then receive the history.
    pub(crate) fn update_connections(&self) {
        for class in &self.shared.classes {
            let publisher = class
                .publisher
                .read()
                .unwrap_or_else(PoisonError::into_inner);
            if let Err(why) = publisher.update_connections() {
                tracing::debug!(?why, topic = class.row.name, "cannot connect every peer");
            }
        }
    }

    /// Stops lending and publishing. When this returns, documents no longer create files of the
    /// bus.
    pub(crate) fn stop(&self) {
        let stopped = self.shared.stopped.write();
        *stopped.unwrap_or_else(PoisonError::into_inner) = true;
    }

    fn give_back(&self, ours: usize) {
        for (index, class) in self.shared.classes.iter().enumerate() {
            let image_use = (index != ours).then(|| ImageUse::take(&class.lent, class.row.loans));
            class.empty(&self.shared);
            drop(image_use);
        }
        self.shared.again.notify_one();
    }
}

/// Returns the reason why a slot is not available if the address space is limited.
fn limited_addresses(needed: u64) -> Option<LoanError> {
    let limit = rustix::process::getrlimit(rustix::process::Resource::As).current;
    limit.map(|limit| LoanError::AddressSpace { needed, limit })
}

type Uninit = iceoryx2::sample_mut_uninit::SampleMutUninit<
    Service,
    [std::mem::MaybeUninit<Block>],
    DocumentHeader,
>;

#[expect(
    unsafe_code,
    reason = "zeroing 100 MB only to overwrite it would cost more than sending it"
)]
fn initialised(sample: Uninit) -> SampleMut<Service, [Block], DocumentHeader> {
    // SAFETY: the slot is shared memory from the kernel, so its bytes are initialised: zero or the
    // content of an earlier image. Every pattern of bytes is a valid `Block` (it is `Pod`).
    unsafe { sample.assume_init() }
}

/// A slot to be filled. Dropping it returns the slot.
pub struct Loan {
    sample: SampleMut<Service, [Block], DocumentHeader>,
    class: usize,
    len: usize,
    mapped_image: ImageUse,
    _lent: ImageUse,
    documents: Documents,
}

impl Loan {
    /// Publishes the first `used` bytes to every peer and keeps holding them.
    ///
    /// # Errors
    /// See [`PublishError`].
    pub fn publish(
        self,
        doc: DocId,
        used: usize,
        digest: Digest,
        kind: FileKind,
    ) -> Result<MappedImage, PublishError> {
        let lent = self.len;
        if used > lent {
            return Err(PublishError::TooMuchUsed { used, lent });
        }
        let mut sample = self.sample;
        *sample.user_header_mut() = DocumentHeader {
            generation: self.documents.shared.generation,
            doc: doc.0,
            used: used as u64,
            digest: digest.0,
            kind: kind_code(kind),
            reserved: 0,
        };
        let shared = &self.documents.shared;
        let Some(_open) = shared.open() else {
            return Err(PublishError::Bus("the broker has stopped".to_owned()));
        };
        let class = &shared.classes[self.class];
        class.used.store(true, Ordering::Release);
        let own = class.own.lock().unwrap_or_else(PoisonError::into_inner);
        let refused = |why: String| PublishError::Bus(why);
        // An error may concern a single peer, so the check is whether the broker receives the
        // image.
        let sent = sample.send();
        while let Some(back) = own.receive().map_err(|why| refused(format!("{why:?}")))? {
            if back.user_header().doc == doc.0 {
                return MappedImage::new(back, self.documents.shared.generation, self.mapped_image)
                    .ok_or_else(|| refused("the image came back changed".to_owned()));
            }
        }
        Err(refused(format!("the image did not come back: {sent:?}")))
    }
}

impl Deref for Loan {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        let bytes: &[u8] = bytemuck::cast_slice(self.sample.payload());
        &bytes[..self.len]
    }
}

impl DerefMut for Loan {
    fn deref_mut(&mut self) -> &mut [u8] {
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(self.sample.payload_mut());
        &mut bytes[..self.len]
    }
}

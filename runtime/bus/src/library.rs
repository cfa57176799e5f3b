//! A peer's side of the document topics: which documents it holds and which it releases first.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use qcbus_messages::DocId;
use qcbus_messages::services::{Services, Topic};

use crate::mapped_image::{Block, DocumentHeader, ImageUse, LET_GO, MappedImage};
use crate::ports::{self, Hub, PortError, Sub};

struct Subscription {
    row: Topic,
    subscriber: Sub<Block, DocumentHeader>,
    out: Arc<AtomicUsize>,
    books: BTreeMap<DocId, Book>,
    /// Documents of jobs that the peer has not finished, whether they have arrived or not.
    wanted: BTreeSet<DocId>,
}

struct Book {
    mapped_image: MappedImage,
    /// Whether the peer has finished with it.
    released: bool,
    used_at: u64,
}

/// The documents that a peer holds.
pub(crate) struct Library {
    generation: u64,
    clock: u64,
    subscriptions: [Subscription; 2],
}

/// Result of reading the next sample.
enum Next {
    Document(MappedImage),
    /// The broker needs shared memory.
    LetGo,
    Nothing,
}

impl Library {
    pub(crate) fn new(
        hub: &Hub,
        generation: u64,
        services: &Services,
    ) -> Result<Library, PortError> {
        Ok(Library {
            generation,
            clock: 0,
            subscriptions: [
                Subscription::new(hub, services.document_small)?,
                Subscription::new(hub, services.document_large)?,
            ],
        })
    }

    /// Receives published documents and calls `arrived` with the number of each. Returns `true` if
    /// the broker needs shared memory, so that cached documents must be released.
    pub(crate) fn drain(&mut self, mut arrived: impl FnMut(DocId)) -> bool {
        let mut asked = false;
        for subscription in &mut self.subscriptions {
            loop {
                let mapped_image = match subscription.receive(self.generation) {
                    Next::Document(mapped_image) => mapped_image,
                    Next::LetGo => {
                        asked = true;
                        continue;
                    }
                    Next::Nothing => break,
                };
                self.clock += 1;
                let book = Book {
                    released: false,
                    used_at: self.clock,
                    mapped_image,
                };
                let doc = book.mapped_image.doc();
                subscription.books.insert(doc, book);
                arrived(doc);
            }
        }
        asked
    }

    pub(crate) fn get(&self, doc: DocId) -> Option<MappedImage> {
        self.subscriptions
            .iter()
            .find_map(|subscription| subscription.books.get(&doc))
            .map(|book| book.mapped_image.clone())
    }

    /// Marks a document as needed by a job. It stays as long as another one can be released.
    pub(crate) fn want(&mut self, doc: DocId) {
        for subscription in &mut self.subscriptions {
            subscription.wanted.insert(doc);
        }
    }

    pub(crate) fn forget(&mut self, doc: DocId) {
        for subscription in &mut self.subscriptions {
            subscription.wanted.remove(&doc);
            if let Some(book) = subscription.books.get_mut(&doc) {
                self.clock += 1;
                book.released = true;
                book.used_at = self.clock;
            }
            subscription.tidy();
        }
    }
}

impl Subscription {
    fn new(hub: &Hub, row: Topic) -> Result<Subscription, PortError> {
        let service = hub.topic::<Block, DocumentHeader>(&row, "")?;
        Ok(Subscription {
            subscriber: ports::subscriber(&service, &row)?,
            row,
            out: Arc::default(),
            books: BTreeMap::new(),
            wanted: BTreeSet::new(),
        })
    }

    /// Returns the next document, unless there is none or documents in use take every permit.
    fn receive(&mut self, generation: u64) -> Next {
        loop {
            let Some(image_use) = self.hand() else {
                return Next::Nothing;
            };
            match self.subscriber.receive() {
                Ok(Some(sample)) if sample.user_header().doc == LET_GO => {
                    // Documents in use are included: they are released when their holder drops
                    // them.
                    self.books.retain(|_, book| !book.released);
                    return Next::LetGo;
                }
                Ok(Some(sample)) => {
                    if let Some(mapped_image) = MappedImage::new(sample, generation, image_use) {
                        return Next::Document(mapped_image);
                    }
                }
                Ok(None) => return Next::Nothing,
                Err(why) => {
                    tracing::debug!(?why, topic = self.row.name, "cannot read documents");
                    return Next::Nothing;
                }
            }
        }
    }

    /// Returns a free permit. If there is none, it releases the least needed document first.
    fn hand(&mut self) -> Option<ImageUse> {
        loop {
            if let Some(image_use) = ImageUse::take(&self.out, self.row.borrowed - 1) {
                return Some(image_use);
            }
            let unused = self
                .books
                .iter()
                .filter(|(_, it)| it.mapped_image.is_unused());
            let need = |(doc, book): &(&DocId, &Book)| {
                (self.wanted.contains(doc), !book.released, book.used_at)
            };
            let least = unused.min_by_key(need).map(|(doc, _)| *doc)?;
            self.books.remove(&least);
        }
    }

    /// Keeps only a few finished documents. A map may be needed again, but each cached one takes
    /// memory that the broker cannot use.
    fn tidy(&mut self) {
        let keep = self.row.buffer.div_ceil(4);
        let mut released: Vec<(u64, DocId)> = self
            .books
            .iter()
            .filter(|(_, book)| book.released)
            .map(|(doc, book)| (book.used_at, *doc))
            .collect();
        released.sort_unstable();
        let surplus = released.len().saturating_sub(keep);
        for (_, doc) in &released[..surplus] {
            self.books.remove(doc);
        }
    }
}

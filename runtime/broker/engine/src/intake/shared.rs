//! Documents that several files refer to: maps and catalogs. Each is read and published once, even
//! if many files need it at the same time. It stays cached while it is unchanged.

use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use qcbus_disk::foreign;
use qcbus_environment::now;
use qcbus_messages::DocId;

use super::gathered::{has_its_stamps, is_unchanged};
use super::{Published, lock};

/// Numbers of small and large documents that stay cached after their jobs. They are separate
/// because a scenario may have a dozen catalogs, which must not evict its map.
const KEPT: [usize; 2] = [24, 8];

/// Size in bytes above which an image counts as large. A large image takes a slot of the bus's large class.
const LARGE: usize = 512 << 10;

/// Cache of shared documents.
#[derive(Debug, Default)]
pub(super) struct Shared(Mutex<Slots>);

/// Key of a document: the reader, the path and the include boundary. Readers may have different
/// access to the included files, and an included file may lie outside of the boundary.
type Key = (Option<foreign::Reader>, PathBuf, PathBuf);

#[derive(Debug, Default)]
struct Slots {
    by_path: HashMap<Key, Arc<Slot>>,
    /// Cached documents by size class. The most recently used one is the last.
    order: [VecDeque<Key>; 2],
}

/// Slot of a document. It is locked while the document is read. Other threads wait for the document
/// and do not read it again.
type Slot = Mutex<Option<Kept>>;

#[derive(Debug)]
struct Kept {
    published: Published,
    /// Time at which the last reading of the bytes began.
    begun: Instant,
}

impl Kept {
    /// Checks whether the file certainly had these bytes at some time after the request.
    ///
    /// The stamps prove this unless they were too young. In that case only a reading counts that
    /// began after the request, because it includes all earlier writes. One reading of a new map is
    /// enough for many files that arrive at once and refer to it.
    fn counts(&self, asked: Instant) -> bool {
        let inputs = &self.published.inputs;
        let settled = !self.published.racy && inputs.iter().all(is_unchanged);
        settled || (self.begun >= asked && inputs.iter().all(has_its_stamps))
    }
}

impl Shared {
    /// Returns the document at a path. Reads it unless the cached one is still valid. `read`
    /// receives the previously published document, because the bytes may be the same.
    pub(super) fn get<E>(
        &self,
        path: &Path,
        boundary: &Path,
        asked: Instant,
        read: impl FnOnce(Option<&Published>) -> Result<Published, E>,
    ) -> Result<Published, E> {
        let key = &(
            foreign::reader(),
            path.to_path_buf(),
            boundary.to_path_buf(),
        );
        let slot = lock(&self.0).slot(key);
        let mut kept = lock(&slot);
        if let Some(kept) = kept.as_ref().filter(|kept| kept.counts(asked)) {
            lock(&self.0).keep(key, &slot, &kept.published);
            return Ok(kept.published.clone());
        }
        let begun = now();
        // The cached document is no longer valid, even if the reading fails.
        let before = kept.take();
        let published = read(before.as_ref().map(|before| &before.published));
        match &published {
            Ok(published) => {
                lock(&self.0).keep(key, &slot, published);
                *kept = Some(Kept {
                    published: published.clone(),
                    begun,
                });
            }
            Err(_) => lock(&self.0).remove(key),
        }
        published
    }

    /// Releases the least recently used document among the unused ones. Returns `false` if there is none.
    pub(super) fn make_room(&self, is_used: impl Fn(DocId) -> bool) -> bool {
        let mut slots = lock(&self.0);
        let unused = slots.order.iter().flatten().find(|key| {
            // A locked slot is being read, possibly by the caller. Waiting here could deadlock, because the owner of
            // the lock may wait for `slots`. The next request after this reads the document again.
            let slot = slots.by_path.get(*key);
            let Some(mut kept) = slot.and_then(|slot| slot.try_lock().ok()) else {
                return false;
            };
            kept.take_if(|kept| !is_used(kept.published.doc)).is_some()
        });
        let Some(key) = unused.cloned() else {
            return false;
        };
        slots.remove(&key);
        true
    }

    /// Returns the time at which the last reading of a cached document began.
    #[cfg(test)]
    pub(super) fn begun(&self, path: &Path) -> Option<Instant> {
        let is_it = |(key, _): &(&Key, _)| key.1 == path;
        let slot = lock(&self.0).by_path.iter().find(is_it)?.1.clone();
        let kept = lock(&slot);
        kept.as_ref().map(|kept| kept.begun)
    }
}

impl Slots {
    fn slot(&mut self, key: &Key) -> Arc<Slot> {
        if let Some(slot) = self.by_path.get(key) {
            return slot.clone();
        }
        let slot = Arc::new(Slot::default());
        self.by_path.insert(key.clone(), slot.clone());
        slot
    }

    /// Marks a document as most recently used, and evicts the least recently used ones.
    fn keep(&mut self, key: &Key, slot: &Arc<Slot>, published: &Published) {
        self.forget_order(key);
        // The slot may have been evicted while the document was read.
        self.by_path.insert(key.clone(), slot.clone());
        let class = usize::from(published.held.len() > LARGE);
        self.order[class].push_back(key.clone());
        while self.order[class].len() > KEPT[class] {
            if let Some(oldest) = self.order[class].pop_front() {
                self.by_path.remove(&oldest);
            }
        }
    }

    fn remove(&mut self, key: &Key) {
        self.forget_order(key);
        self.by_path.remove(key);
    }

    fn forget_order(&mut self, key: &Key) {
        for order in &mut self.order {
            order.retain(|other| other != key);
        }
    }
}

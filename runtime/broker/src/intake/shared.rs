//! Documents that several files refer to: maps, catalogs. Each is read and published once, however
//! many files need it at once, and kept as long as it has not changed.

use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Instant;

use qcbus_disk::foreign;
use qcbus_messages::DocId;

use crate::environment::now;

use super::gathered::{has_its_stamps, is_unchanged};
use super::{Published, lock};

/// Documents that are kept beyond the jobs that needed them, the small ones apart from the large:
/// a scenario may have a dozen catalogs, and they must not push out its map.
const KEPT: [usize; 2] = [24, 8];

/// An image of more bytes counts as large: it takes a slot of the bus's large class.
const LARGE: usize = 512 << 10;

/// The shared documents.
#[derive(Debug, Default)]
pub(super) struct Shared(Mutex<Slots>);

/// A document as somebody may see it: what it includes may be open to the one and not to the other, and may lie beyond
/// the directory that includes may not leave.
type Key = (Option<foreign::Reader>, PathBuf, PathBuf);

#[derive(Debug, Default)]
struct Slots {
    by_path: HashMap<Key, Arc<Slot>>,
    /// Those that are kept, by size; the one that was asked for last is at the end.
    order: [VecDeque<Key>; 2],
}

/// A document's place. It is locked while the document is read, so that whoever wants the same one
/// waits for it instead of reading it as well.
type Slot = Mutex<Option<Kept>>;

#[derive(Debug)]
struct Kept {
    published: Published,
    /// When its bytes were last begun to be read.
    begun: Instant,
}

impl Kept {
    /// Whether these certainly are the bytes that lay there at some time after somebody asked.
    ///
    /// The stamps tell, unless they were too young to do so. Then only a reading counts that began
    /// after the question: what was written before that is in it. Many files that have come at once
    /// and refer to a map that was just written need one reading of it, not one each.
    fn counts(&self, asked: Instant) -> bool {
        let inputs = &self.published.inputs;
        let settled = !self.published.racy && inputs.iter().all(is_unchanged);
        settled || (self.begun >= asked && inputs.iter().all(has_its_stamps))
    }
}

impl Shared {
    /// The document at a path. It is read unless what is known of it counts; `read` gets what was
    /// published before, because the bytes may turn out to be the same.
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
        // Whatever comes of it: what was known before counts for nobody any more.
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

    /// Lets go of the document that was not asked for for longest, of those that nobody uses.
    /// `false`: there is none.
    pub(super) fn make_room(&self, is_used: impl Fn(DocId) -> bool) -> bool {
        let mut slots = lock(&self.0);
        let unused = slots.order.iter().flatten().find(|key| {
            // One that is locked is being read, perhaps by who asks for room. Nobody may be waited for
            // here: whoever has the lock may be waiting for the slots. Who asks for it after this reads
            // it anew.
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

    /// When the bytes of a document that is kept were last begun to be read.
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

    /// Remembers that a document was asked for, and lets go of those that were not for longest.
    fn keep(&mut self, key: &Key, slot: &Arc<Slot>, published: &Published) {
        self.forget_order(key);
        // It may have been pushed out while it was read.
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

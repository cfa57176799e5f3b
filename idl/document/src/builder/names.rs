//! The distinct names of a document during building: a small hash table for the two lookups that
//! each tag needs.

use std::hash::{BuildHasher, Hasher, RandomState};

use super::BuildError;
use crate::layout::{NAME_IN_HEAP, NameRecord, U32};

/// Maximum number of names: all 16-bit ids except the marker of a free slot.
pub(super) const MAX_NAMES: usize = FREE as usize;
const FREE: u16 = u16::MAX;

pub(super) struct Names {
    /// Ids with open addressing. The length is a power of two, and the table is at most half full.
    slots: Vec<u16>,
    names: Vec<Name>,
    /// The bytes of all names.
    letters: Vec<u8>,
    capacity: usize,
    /// Random seed of each builder, so that a prepared file cannot make all names collide.
    seed: u64,
}

struct Name {
    key: Key,
    start: usize,
    len: usize,
    record: NameRecord,
}

impl Names {
    pub(super) fn new(capacity: usize) -> Names {
        let seed = RandomState::new().build_hasher().finish();
        Names {
            slots: vec![FREE; 256],
            names: Vec::new(),
            letters: Vec::new(),
            capacity: capacity.min(MAX_NAMES),
            seed,
        }
    }

    #[inline]
    pub(super) fn find(&self, name: &str) -> Option<u16> {
        let key = Key::of(name.as_bytes(), self.seed);
        let mask = self.slots.len() - 1;
        let mut slot = key.hash as usize & mask;
        loop {
            let id = self.slots[slot];
            if id == FREE {
                return None;
            }
            let known = &self.names[usize::from(id)];
            // For up to eight bytes, the key alone identifies the name.
            if known.key == key
                && (name.len() <= 8
                    || self.letters[known.start..known.start + known.len] == *name.as_bytes())
            {
                return Some(id);
            }
            slot = (slot + 1) & mask;
        }
    }

    /// Adds a name that [`find`](Names::find) does not know, with one position where it is written.
    pub(super) fn add(
        &mut self,
        name: &str,
        offset: u32,
        in_heap: bool,
    ) -> Result<u16, BuildError> {
        if self.names.len() >= MAX_NAMES {
            return Err(BuildError::TooManyNames);
        }
        if self.names.len() >= self.capacity {
            return Err(BuildError::NoRoom {
                what: "names",
                capacity: self.capacity,
            });
        }
        let id = u16::try_from(self.names.len()).map_err(|_| BuildError::TooManyNames)?;
        let len = u32::try_from(name.len())
            .ok()
            .filter(|len| len & NAME_IN_HEAP == 0);
        let len = len.ok_or(BuildError::TooLarge {
            what: "the characters of a name",
        })?;
        let record = NameRecord {
            offset: U32::new(offset),
            len: U32::new(len | if in_heap { NAME_IN_HEAP } else { 0 }),
            first_posting: U32::new(0),
            postings: U32::new(0),
        };
        let key = Key::of(name.as_bytes(), self.seed);
        self.names.push(Name {
            key,
            start: self.letters.len(),
            len: name.len(),
            record,
        });
        self.letters.extend_from_slice(name.as_bytes());
        self.enter(id, key.hash);
        Ok(id)
    }

    #[inline]
    pub(super) fn count_element(&mut self, id: u16) {
        let postings = &mut self.names[usize::from(id)].record.postings;
        *postings = U32::new(postings.get() + 1);
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// Returns the records with their ranges of postings.
    pub(super) fn records(&self) -> Vec<NameRecord> {
        let mut first = 0;
        let place = |name: &Name| {
            let record = NameRecord {
                first_posting: U32::new(first),
                ..name.record
            };
            first += record.postings.get();
            record
        };
        self.names.iter().map(place).collect()
    }

    /// Returns the ids sorted by the bytes of their names.
    pub(super) fn order(&self) -> Vec<u16> {
        let mut order: Vec<u16> = (0..self.names.len())
            .map_while(|id| u16::try_from(id).ok())
            .collect();
        order.sort_unstable_by_key(|&id| {
            let name = &self.names[usize::from(id)];
            &self.letters[name.start..name.start + name.len]
        });
        order
    }

    fn enter(&mut self, id: u16, hash: u64) {
        if self.names.len() * 2 > self.slots.len() {
            let mut slots = vec![FREE; self.slots.len() * 2];
            for (id, name) in (0..).zip(&self.names) {
                take_slot(&mut slots, id, name.key.hash);
            }
            self.slots = slots;
        } else {
            take_slot(&mut self.slots, id, hash);
        }
    }
}

fn take_slot(slots: &mut [u16], id: u16, hash: u64) {
    let mask = slots.len() - 1;
    let mut slot = hash as usize & mask;
    while slots[slot] != FREE {
        slot = (slot + 1) & mask;
    }
    slots[slot] = id;
}

/// Key for a quick comparison of names: length, eight of the bytes, and a hash of all.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Key {
    len: usize,
    letters: u64,
    hash: u64,
}

impl Key {
    /// Hashes eight bytes at a time with a wide multiplication; names have four to twenty bytes.
    #[inline]
    fn of(name: &[u8], seed: u64) -> Key {
        let mut state = seed ^ name.len() as u64;
        let letters = if let Some(last) = name.last_chunk::<8>() {
            for word in name.as_chunks::<8>().0 {
                state = fold(state, u64::from_le_bytes(*word));
            }
            u64::from_le_bytes(*last)
        } else if let (Some(first), Some(last)) = (name.first_chunk::<4>(), name.last_chunk::<4>())
        {
            u64::from(u32::from_le_bytes(*first)) << 32 | u64::from(u32::from_le_bytes(*last))
        } else {
            name.iter()
                .fold(0, |word, &byte| word << 8 | u64::from(byte))
        };
        Key {
            len: name.len(),
            letters,
            hash: fold(state, letters),
        }
    }
}

#[inline]
fn fold(state: u64, word: u64) -> u64 {
    // The factor is an odd number without a pattern: the fraction of the golden ratio.
    let wide = u128::from(state ^ word) * 0x9E37_79B9_7F4A_7C15;
    (wide as u64) ^ (wide >> 64) as u64
}

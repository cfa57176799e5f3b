//! The ledger: which bytes lay at which place from when to when.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use crate::support::content::Content;

/// What somebody may have read at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offered<'l> {
    /// Bytes with this digest.
    Bytes(&'l str),
    /// Something half-written.
    Unfinished,
    /// Nothing lay there.
    Nothing,
}

/// What was done to a file.
#[derive(Debug, Clone)]
struct Change {
    /// When it began.
    begun: Duration,
    /// When it was over.
    done: Duration,
    /// What has lain there since; `None`: nothing.
    digest: Option<String>,
}

/// What the driver has done to all files.
#[derive(Debug)]
pub struct Ledger {
    pub start: Instant,
    known: BTreeMap<String, Content>,
    changes: BTreeMap<String, Vec<Change>>,
}

impl Ledger {
    pub fn new() -> Ledger {
        Ledger {
            start: Instant::now(),
            known: BTreeMap::new(),
            changes: BTreeMap::new(),
        }
    }

    /// How long it has been kept.
    pub fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// A change that began at `begun` is over.
    pub fn note(&mut self, name: &str, begun: Duration, content: Option<&Content>) {
        let done = self.now();
        let digest = content.map(|content| {
            let digest = digest(&content.bytes());
            self.known.insert(digest.clone(), content.clone());
            digest
        });
        let changes = self.changes.entry(name.to_owned()).or_default();
        changes.push(Change {
            begun,
            done,
            digest,
        });
    }

    /// What has this digest.
    pub fn content(&self, digest: &str) -> Option<&Content> {
        self.known.get(digest)
    }

    /// Everything that may have been read at a place in this time.
    pub fn seen(&self, name: &str, from: Duration, to: Duration) -> Vec<Offered<'_>> {
        let changes = self.changes.get(name).map_or(&[][..], Vec::as_slice);
        let mut seen = Vec::new();
        for (at, change) in changes.iter().enumerate() {
            let over = changes.get(at + 1).map_or(Duration::MAX, |next| next.done);
            if change.begun <= to && over >= from {
                let digest = change.digest.as_deref();
                seen.push(digest.map_or(Offered::Nothing, Offered::Bytes));
            }
            if change.begun <= to && change.done >= from {
                seen.push(Offered::Unfinished);
            }
        }
        seen
    }

    /// Whether these bytes lay at a place before this time.
    pub fn had_bytes(&self, name: &str, digest: &str, to: Duration) -> bool {
        let seen = self.seen(name, Duration::ZERO, to);
        seen.contains(&Offered::Bytes(digest))
    }
}

/// SHA-256 in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

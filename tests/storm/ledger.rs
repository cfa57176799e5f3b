//! The ledger records the bytes at each path over time.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use sha2::{Digest, Sha256};

use crate::support::content::Content;

/// Content that a reader may have found at a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Offered<'l> {
    /// Bytes with this digest.
    Bytes(&'l str),
    /// Half-written content.
    Unfinished,
    /// No file.
    Nothing,
}

/// A change of a file.
#[derive(Debug, Clone)]
struct Change {
    /// Start of the change.
    begun: Duration,
    /// End of the change.
    done: Duration,
    /// Digest of the new content, or `None` if the file was removed.
    digest: Option<String>,
}

/// All changes that the driver has made to files.
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

    /// Returns the time since the start of the ledger.
    pub fn now(&self) -> Duration {
        self.start.elapsed()
    }

    /// Records a finished change that began at `begun`.
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

    /// Returns the content with this digest.
    pub fn content(&self, digest: &str) -> Option<&Content> {
        self.known.get(digest)
    }

    /// Returns everything that may have been read at a path in this period.
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

    /// Checks whether these bytes were at a path before this time.
    pub fn had_bytes(&self, name: &str, digest: &str, to: Duration) -> bool {
        let seen = self.seen(name, Duration::ZERO, to);
        seen.contains(&Offered::Bytes(digest))
    }
}

/// Returns the SHA-256 in hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    let digest = Sha256::digest(bytes);
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

//! The journal as shared by the writer threads. The writing thread also writes all entries of others, in one
//! transaction. Many verdicts cost little more than one, and a single verdict does not wait.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use super::write::{Change, changes};
use super::{Entry, Journal};

/// Result of a write. The error text is for the user.
type Answer = Result<(), String>;

/// A journal that several threads write.
#[derive(Debug)]
pub struct SharedJournal {
    queue: Mutex<Queue>,
    /// Signals that a thread has finished writing.
    written: Condvar,
    journal: Mutex<Journal>,
}

#[derive(Debug, Default)]
struct Queue {
    /// Waiting entries, in the order of arrival.
    waiting: Vec<Note>,
    /// Whether a thread is writing.
    is_led: bool,
}

/// Entries that wait to be written.
#[derive(Debug)]
struct Note {
    changes: Vec<Change>,
    answer: Arc<OnceLock<Answer>>,
}

/// Handle of waiting entries. They are written by the thread that added them, or by one that writes earlier.
#[derive(Debug)]
#[must_use = "entries are not written until they are settled"]
pub struct Noted(Arc<OnceLock<Answer>>);

impl From<Journal> for SharedJournal {
    fn from(journal: Journal) -> SharedJournal {
        SharedJournal {
            queue: Mutex::default(),
            written: Condvar::new(),
            journal: Mutex::new(journal),
        }
    }
}

impl SharedJournal {
    /// Adds entries to the queue. All of them are written, or none.
    pub fn note(&self, entries: &[Entry]) -> Noted {
        let changes = entries.iter().flat_map(changes).collect();
        let answer = Arc::new(OnceLock::new());
        let noted = Noted(answer.clone());
        self.queue().waiting.push(Note { changes, answer });
        noted
    }

    /// Waits until the entries are written or the write has failed. After a failure the caller must
    /// keep them.
    ///
    /// # Errors
    /// A text for the user.
    pub fn settle(&self, noted: &Noted) -> Answer {
        let mut queue = self.queue();
        loop {
            if let Some(answer) = noted.0.get() {
                return answer.clone();
            }
            if !queue.is_led {
                break;
            }
            let woken = self.written.wait(queue);
            queue = woken.unwrap_or_else(PoisonError::into_inner);
        }
        queue.is_led = true;
        let together = std::mem::take(&mut queue.waiting);
        drop(queue);
        let lead = Lead(self);
        write(&mut self.get(), &together);
        drop(lead);
        // If the writing thread panics, the entries of other threads get no answer.
        let lost = || Err("the journal was not written: a writer thread panicked".to_owned());
        noted.0.get().cloned().unwrap_or_else(lost)
    }

    /// Returns the journal itself.
    pub fn get(&self) -> MutexGuard<'_, Journal> {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Leadership of the writing thread. When it is dropped, also by a panic, the next thread may write.
struct Lead<'a>(&'a SharedJournal);

impl Drop for Lead<'_> {
    fn drop(&mut self) {
        self.0.queue().is_led = false;
        self.0.written.notify_all();
    }
}

/// Writes all notes at once. If that fails, writes each note separately, so that failures stay separate.
fn write(journal: &mut Journal, notes: &[Note]) {
    let all: Vec<&[Change]> = notes.iter().map(|it| &it.changes[..]).collect();
    let together = journal.make(&all);
    for note in notes {
        let made = match &together {
            Ok(()) => Ok(()),
            Err(error) if notes.len() == 1 => Err(error.to_string()),
            Err(_) => journal
                .make(&[&note.changes])
                .map_err(|error| error.to_string()),
        };
        // Only this thread sets the answer, so `set` cannot fail.
        let _ = note.answer.set(made);
    }
}

impl Entry {
    /// Returns the file of the entry, or `None` if the entry is about a bundle.
    pub fn path(&self) -> Option<&Arc<Path>> {
        match self {
            Entry::Judged { path, .. }
            | Entry::Withdrawn { path, .. }
            | Entry::Left { path, .. }
            | Entry::Voided { path, .. }
            | Entry::Delivered { path, .. } => Some(path),
            Entry::Enrolled(_) | Entry::Struck { .. } => None,
        }
    }
}

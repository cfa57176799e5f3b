//! The journal among the threads that write: whoever writes writes what all others have noted meanwhile,
//! too, in one transaction. So many verdicts cost little more than one, and a single one waits for nobody.

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};

use super::write::{Change, changes};
use super::{Entry, Journal};

/// What came of it; why it could not be written is for a person.
type Answer = Result<(), String>;

/// A journal that several threads write.
#[derive(Debug)]
pub struct SharedJournal {
    queue: Mutex<Queue>,
    /// Somebody has written.
    written: Condvar,
    journal: Mutex<Journal>,
}

#[derive(Debug, Default)]
struct Queue {
    /// In the order in which they came.
    waiting: Vec<Note>,
    /// Somebody is writing.
    is_led: bool,
}

/// Entries that are to be written.
#[derive(Debug)]
struct Note {
    changes: Vec<Change>,
    answer: Arc<OnceLock<Answer>>,
}

/// Entries that somebody will write: who has noted them, or who writes before him.
#[derive(Debug)]
#[must_use = "nothing is written before it is settled"]
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
    /// Puts entries down to be written, all of them or none.
    pub fn note(&self, entries: &[Entry]) -> Noted {
        let changes = entries.iter().flat_map(changes).collect();
        let answer = Arc::new(OnceLock::new());
        let noted = Noted(answer.clone());
        self.queue().waiting.push(Note { changes, answer });
        noted
    }

    /// Waits until they are written, or cannot be: then they are not, and the caller's to keep.
    ///
    /// # Errors
    /// For a person.
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
        // Who panicked while he wrote for others leaves them without an answer.
        let lost = || Err("the journal was not written: a writer has panicked".to_owned());
        noted.0.get().cloned().unwrap_or_else(lost)
    }

    /// The journal itself.
    pub fn get(&self) -> MutexGuard<'_, Journal> {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Who writes for others; the next may when this is dropped, also by a panic.
struct Lead<'a>(&'a SharedJournal);

impl Drop for Lead<'_> {
    fn drop(&mut self) {
        self.0.queue().is_led = false;
        self.0.written.notify_all();
    }
}

/// Writes all notes at once. When that fails each is written by itself, so that none fails for another.
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
        // Nobody else answers.
        let _ = note.answer.set(made);
    }
}

impl Entry {
    /// The file that it is about; `None` when it is about a bundle.
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

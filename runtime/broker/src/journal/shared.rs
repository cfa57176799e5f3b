//! The journal among the threads that write: whoever holds it writes what all others have for it who wait,
//! in one transaction. So many verdicts cost little more than one, and a single one waits for nobody.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::write::{Change, changes};
use super::{Entry, Journal};

/// What came of it; why it could not be written is for a person.
type Answer = Result<(), String>;

/// A journal that several threads write.
#[derive(Debug)]
pub struct SharedJournal {
    /// In the order in which they came.
    waiting: Mutex<Vec<Note>>,
    journal: Mutex<Journal>,
}

/// Entries that are to be written.
#[derive(Debug)]
struct Note {
    changes: Vec<Change>,
    answer: Arc<OnceLock<Answer>>,
}

/// Entries that somebody will write: who has noted them, or who holds the journal before him.
#[derive(Debug)]
#[must_use = "nothing is written before it is settled"]
pub struct Noted(Arc<OnceLock<Answer>>);

impl From<Journal> for SharedJournal {
    fn from(journal: Journal) -> SharedJournal {
        SharedJournal {
            waiting: Mutex::default(),
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
        self.waiting().push(Note { changes, answer });
        noted
    }

    /// Waits until they are written, or cannot be: then they are not, and the caller's to keep.
    ///
    /// # Errors
    /// For a person.
    pub fn settle(&self, noted: &Noted) -> Answer {
        let mut journal = self.get();
        if noted.0.get().is_none() {
            let together = std::mem::take(&mut *self.waiting());
            write(&mut journal, &together);
        }
        // Who panicked while he wrote for others leaves them without an answer, and nothing written.
        let lost = || Err("the journal was not written: a writer has panicked".to_owned());
        noted.0.get().cloned().unwrap_or_else(lost)
    }

    /// The journal itself.
    pub fn get(&self) -> MutexGuard<'_, Journal> {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn waiting(&self) -> MutexGuard<'_, Vec<Note>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
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

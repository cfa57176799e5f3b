//! Withdrawal of the output about a file.

use std::io;
use std::path::Path;
use std::sync::Arc;

use qcbus_disk::{remove, remove_empty_above};
use qcbus_environment::{disk, step};
use qcbus_messages::path_text::to_text;

use super::{Store, StoreFailure};
use crate::journal::{Entry, JournalError, Void};

impl Store {
    /// Removes the output about a removed file, and records the reporters that must withdraw a
    /// report about it.
    ///
    /// # Errors
    /// A message for the user. The action must be tried again.
    pub fn withdraw(&self, path: &Arc<Path>, reporters: &[String]) -> Result<(), StoreFailure> {
        self.withdraw_files(path).map_err(|error| StoreFailure {
            what: format!("cannot withdraw the result of {}: {error}", to_text(path)),
            concerns_all: false,
        })?;
        step("withdrawn", path);
        let entry = Entry::Withdrawn {
            path: path.clone(),
            reporters: reporters.to_vec(),
        };
        self.record(&[entry]).map_err(StoreFailure::of_all)
    }

    /// Removes the published copy first. Removes the verdict file last, because it shows that a result existed.
    pub(super) fn withdraw_files(&self, path: &Arc<Path>) -> io::Result<()> {
        if let Some(gate) = &self.gate {
            gate.forget(path)?;
            step("closed", path);
        }
        self.lock.hold().map_err(io::Error::other)?;
        let (xqar, verdict) = (self.places.xqar(path), self.places.verdict(path));
        self.outputs.changing(&xqar);
        self.outputs.changing(&verdict);
        disk()?;
        remove(&xqar)?;
        step("half withdrawn", path);
        disk()?;
        remove(&verdict)?;
        self.tidy_above(path);
        Ok(())
    }

    /// Removes directories of results that became empty when a result, or a report next to it, was removed.
    pub fn tidy_above(&self, path: &Path) {
        remove_empty_above(&self.places.xqar(path), &self.places.out);
    }

    /// Returns the reports that reporters must still withdraw. Reports next to results outside of
    /// this broker's directory belong to another broker: their entries are deleted and the reports
    /// stay.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn voids(&self) -> Result<Vec<Void>, JournalError> {
        let Some(journal) = &self.journal else {
            return Ok(Vec::new());
        };
        let voids = journal.get().voids()?;
        let is_ours = |void: &Void| {
            let xqar = void.xqar.as_ref();
            xqar.is_none_or(|xqar| self.places.owns(xqar))
        };
        let (ours, others): (Vec<Void>, Vec<Void>) = voids.into_iter().partition(is_ours);
        let forgotten = others.into_iter().map(|void| Entry::Voided {
            path: void.path,
            reporter: void.reporter,
        });
        let forgotten: Vec<Entry> = forgotten.collect();
        if !forgotten.is_empty()
            && let Err(why) = self.record(&forgotten)
        {
            // The next start finds the same state and tries again.
            tracing::warn!("{why}");
        }
        Ok(ours)
    }
}

//! Taking back what was written about a file.

use std::io;
use std::path::Path;
use std::sync::Arc;

use qcbus_messages::path_text::to_text;

use super::{Store, Trouble};
use crate::journal::Entry;
use crate::seams::{disk, step};
use qcbus_disk::remove;

impl Store {
    /// Removes what was written for a file that has gone, and remembers who is to take back a
    /// report about it.
    ///
    /// # Errors
    /// What a person should know; it is to be tried again.
    pub fn withdraw(&self, path: &Arc<Path>, reporters: &[String]) -> Result<(), Trouble> {
        self.withdraw_files(path).map_err(|error| Trouble {
            what: format!("cannot withdraw the result of {}: {error}", to_text(path)),
            concerns_all: false,
        })?;
        step("withdrawn", path);
        let entry = Entry::Withdrawn {
            path: path.clone(),
            reporters: reporters.to_vec(),
        };
        self.record(&[entry]).map_err(Trouble::of_all)
    }

    /// First what others may take for accepted, last what tells that there was a result.
    pub(super) fn withdraw_files(&self, path: &Arc<Path>) -> io::Result<()> {
        if let Some(gate) = &self.gate {
            gate.forget(path)?;
            step("closed", path);
        }
        disk()?;
        remove(&self.places.xqar(path))?;
        step("half withdrawn", path);
        disk()?;
        remove(&self.places.verdict(path))
    }
}

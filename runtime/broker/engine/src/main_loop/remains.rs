//! Partial files that killed processes have left among the results.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use qcbus_disk::Writer;

use crate::options::Options;

/// Removes partial files below the directories of the broker. A killed process that waits for the
/// disk lives on for a while, and nobody reports its end if an earlier broker has started it.
/// Therefore the writers of the files that stay are remembered, and looked at again.
#[derive(Debug, Clone)]
pub(super) struct Remains {
    directories: Arc<[PathBuf]>,
    living: Arc<Mutex<Vec<Writer>>>,
}

impl Remains {
    pub(super) fn of(options: &Options) -> Remains {
        let directories = std::iter::once(&options.out).chain(&options.gate);
        Remains {
            directories: directories.cloned().collect(),
            living: Arc::default(),
        }
    }

    /// Removes the remains of former brokers and their children, before this process writes.
    pub(super) fn sweep_first(&self) {
        self.sweep(qcbus_disk::sweep);
    }

    /// Removes the remains of dead processes.
    pub(super) fn sweep_dead(&self) {
        self.sweep(qcbus_disk::sweep_dead);
    }

    /// Checks whether a process has died that was writing during the last sweep.
    pub(super) fn are_expected(&self) -> bool {
        let living = self.living.lock().unwrap_or_else(PoisonError::into_inner);
        living.iter().any(|writer| writer.is_dead())
    }

    fn sweep(&self, how: impl Fn(&Path) -> Vec<Writer>) {
        let found = self.directories.iter().flat_map(|it| how(it)).collect();
        *self.living.lock().unwrap_or_else(PoisonError::into_inner) = found;
    }
}

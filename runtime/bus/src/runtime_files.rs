//! Runtime files of a broker: creates them and restores them when they are removed.
//!
//! Cleaners of temporary directories remove files that have not changed for days. The files that
//! peers look for are restored. Joined bundles are not affected.

use std::sync::{Arc, Mutex, PoisonError};

use crate::generation::Generation;
use crate::instance::{Instance, InstanceLock, LockError};

/// The broker's lock on its instance, until it is released.
pub(crate) type LockSlot = Arc<Mutex<Option<InstanceLock>>>;

/// The runtime files of one broker.
pub(crate) struct RuntimeFiles {
    instance: Instance,
    generation: Generation,
    lock: LockSlot,
    state: Mutex<State>,
    /// Last logged failure to restore a file.
    trouble: Mutex<String>,
    /// Description of a permanent loss, until it is fetched.
    lost: Mutex<Option<String>>,
}

/// How missing files are treated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// They are restored.
    Kept,
    /// They are no longer restored: a loss is permanent and was reported.
    Lost,
    /// They are not restored: the broker is not ready yet, or is ending.
    Hidden,
}

impl RuntimeFiles {
    /// Creates the runtime files of a broker that is still hidden.
    pub(crate) fn new(
        instance: &Instance,
        generation: &Generation,
        lock: &LockSlot,
    ) -> RuntimeFiles {
        RuntimeFiles {
            instance: instance.clone(),
            generation: generation.clone(),
            lock: Arc::clone(lock),
            state: Mutex::new(State::Hidden),
            trouble: Mutex::default(),
            lost: Mutex::default(),
        }
    }

    /// Announces the generation. This is the last step of a start.
    pub(crate) fn announce(&self) -> std::io::Result<()> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        self.generation.announce(&self.instance)?;
        *state = State::Kept;
        Ok(())
    }

    /// Withdraws the generation: peers stop trying to join, and files are no longer restored. This
    /// is the first step of a stop.
    pub(crate) fn withdraw(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        *state = State::Hidden;
        self.generation.withdraw(&self.instance);
    }

    /// Restores removed files and reports those that cannot be restored. Must be called
    /// periodically, outside the loop.
    pub(crate) fn look_after(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if *state != State::Kept {
            return;
        }
        if let Err(lost) = self.restore() {
            let lost = format!("{lost}; no process can join until the broker is restarted");
            tracing::error!("{lost}");
            *self.lost.lock().unwrap_or_else(PoisonError::into_inner) = Some(lost);
            *state = State::Lost;
        }
    }

    /// Returns the permanent loss, for a person. It is returned only once.
    pub(crate) fn loss(&self) -> Option<String> {
        let mut lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        lost.take()
    }

    fn restore(&self) -> Result<(), String> {
        if !self.generation.root.is_dir() {
            let root = self.generation.root.display();
            return Err(format!("the shared memory {root} was removed"));
        }
        self.restore_lock()?;
        if let Err(error) = self.generation.restore(&self.instance) {
            self.say(
                "cannot restore the files that were removed from the runtime directory",
                &error,
            );
        }
        Ok(())
    }

    /// Logs a failure once, however often it occurs.
    fn say(&self, what: &str, error: &std::io::Error) {
        let text = format!("{what}: {error}");
        let mut said = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        if *said != text {
            tracing::warn!("{text}; it is retried repeatedly");
            *said = text;
        }
    }

    /// Restores the lock file. Without the file, the lock does not exclude other brokers.
    fn restore_lock(&self) -> Result<(), String> {
        let mut lock = self.lock.lock().unwrap_or_else(PoisonError::into_inner);
        if lock.as_ref().is_none_or(InstanceLock::is_there) {
            return Ok(());
        }
        let taken = self
            .instance
            .create_dir()
            .map_err(|error| LockError::Io(std::io::Error::other(error)))
            .and_then(|()| InstanceLock::take(&self.instance));
        match taken {
            Ok(taken) => {
                tracing::warn!(
                    "the lock of the runtime directory was removed; it was created again"
                );
                *lock = Some(taken);
                Ok(())
            }
            Err(LockError::Taken { pid }) => {
                let pid = pid
                    .map(|pid| format!(", process {pid}"))
                    .unwrap_or_default();
                Err(format!(
                    "the lock of the runtime directory was removed, and another broker{pid} has taken it since"
                ))
            }
            // The next call tries again.
            Err(LockError::Io(error)) => {
                self.say(
                    "cannot create the lock of the runtime directory again",
                    &error,
                );
                Ok(())
            }
        }
    }
}

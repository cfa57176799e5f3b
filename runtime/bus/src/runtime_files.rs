//! What a broker has in its runtime directory while it runs, and gets back when it is taken away.
//!
//! Temporary directories are cleaned: files go that nobody has changed for days. What peers look for is
//! made again; bundles that have joined notice nothing.

use std::sync::{Arc, Mutex, PoisonError};

use crate::generation::Generation;
use crate::instance::{Instance, InstanceLock, LockError};

/// The broker's claim on its instance, until it is given up.
pub(crate) type LockSlot = Arc<Mutex<Option<InstanceLock>>>;

/// A broker that is to be found.
pub(crate) struct RuntimeFiles {
    instance: Instance,
    generation: Generation,
    lock: LockSlot,
    state: Mutex<State>,
    /// What was said last about what cannot be made again yet.
    trouble: Mutex<String>,
    /// What cannot be had back, until it has been asked for.
    lost: Mutex<Option<String>>,
}

/// What is done about what is missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum State {
    /// It is made again.
    Kept,
    /// Nothing any more: it cannot be had back, and that has been said.
    Lost,
    /// Nothing: the broker is not ready yet, or is going.
    Hidden,
}

impl RuntimeFiles {
    /// Of a broker that is not to be found yet.
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

    /// Makes the generation known. Last step of a start.
    pub(crate) fn announce(&self) -> std::io::Result<()> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        self.generation.announce(&self.instance)?;
        *state = State::Kept;
        Ok(())
    }

    /// Peers stop trying to join, and nothing is made again. First step of a stop.
    pub(crate) fn withdraw(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        *state = State::Hidden;
        self.generation.withdraw(&self.instance);
    }

    /// Makes again what was taken away; says what cannot be. To be called now and then, off the loop.
    pub(crate) fn look_after(&self) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if *state != State::Kept {
            return;
        }
        if let Err(lost) = self.restore() {
            let lost = format!("{lost}; until the broker is started again, nobody can join it");
            tracing::error!("{lost}");
            *self.lost.lock().unwrap_or_else(PoisonError::into_inner) = Some(lost);
            *state = State::Lost;
        }
    }

    /// What cannot be had back, for a person; said once.
    pub(crate) fn loss(&self) -> Option<String> {
        let mut lost = self.lost.lock().unwrap_or_else(PoisonError::into_inner);
        lost.take()
    }

    fn restore(&self) -> Result<(), String> {
        if !self.generation.root.is_dir() {
            let root = self.generation.root.display();
            return Err(format!("somebody has removed the shared memory {root}"));
        }
        self.restore_lock()?;
        if let Err(error) = self.generation.restore(&self.instance) {
            self.say(
                "cannot make again what was removed from the runtime directory",
                &error,
            );
        }
        Ok(())
    }

    /// Once, however often it is tried.
    fn say(&self, what: &str, error: &std::io::Error) {
        let text = format!("{what}: {error}");
        let mut said = self.trouble.lock().unwrap_or_else(PoisonError::into_inner);
        if *said != text {
            tracing::warn!("{text}; it is tried again and again");
            *said = text;
        }
    }

    /// A lock whose file is gone keeps nobody out.
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
                tracing::warn!("the lock of the runtime directory was removed; it was made again");
                *lock = Some(taken);
                Ok(())
            }
            Err(LockError::Taken { pid }) => {
                let pid = pid
                    .map(|pid| format!(", process {pid}"))
                    .unwrap_or_default();
                Err(format!(
                    "somebody has removed the lock of the runtime directory, and another broker{pid} has taken it since"
                ))
            }
            // Next time, perhaps.
            Err(LockError::Io(error)) => {
                self.say(
                    "cannot make the lock of the runtime directory again",
                    &error,
                );
                Ok(())
            }
        }
    }
}

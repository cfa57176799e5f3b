//! Threads, as in [`std::thread`].

use std::io;

use crate::simulation::current;

/// Starts threads; see [`std::thread::Builder`].
#[derive(Debug, Default)]
pub struct Builder(String);

impl Builder {
    /// Returns a builder of a thread without a name.
    pub fn new() -> Builder {
        Builder::default()
    }

    /// Sets the name of the thread.
    #[must_use]
    pub fn name(self, name: String) -> Builder {
        Builder(name)
    }

    /// Starts the thread.
    ///
    /// # Errors
    /// If the system has no room for a further thread.
    pub fn spawn(self, body: impl FnOnce() + Send + 'static) -> io::Result<JoinHandle> {
        if let Some(simulation) = current() {
            simulation.spawn(self.0, Box::new(body));
            return Ok(JoinHandle(None));
        }
        let thread = std::thread::Builder::new().name(self.0);
        thread.spawn(body).map(|it| JoinHandle(Some(it)))
    }
}

/// A started thread; see [`std::thread::JoinHandle`]. It does not wait for simulated threads,
/// because a simulated broker is killed.
#[derive(Debug)]
pub struct JoinHandle(Option<std::thread::JoinHandle<()>>);

impl JoinHandle {
    /// Checks whether the thread has ended.
    pub fn is_finished(&self) -> bool {
        self.0
            .as_ref()
            .is_none_or(std::thread::JoinHandle::is_finished)
    }

    /// Waits for the end of the thread.
    ///
    /// # Errors
    /// The panic that ended the thread.
    pub fn join(self) -> std::thread::Result<()> {
        self.0.map_or(Ok(()), std::thread::JoinHandle::join)
    }
}

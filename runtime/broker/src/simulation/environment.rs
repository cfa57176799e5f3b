//! The system interface of the broker in tests. Inside a simulation it uses the simulation,
//! otherwise the real system.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvError, RecvTimeoutError, TryRecvError};
use std::time::{Duration, Instant, SystemTime};

use qcbus_ingest::Stat;

use super::threads::{Signal, State, here};

pub use super::kernel::{Bell, Kernel};
pub use super::surroundings::{Children, ControlSocket, Host};

/// Checks whether the current thread is simulated.
pub fn is_simulated() -> bool {
    here().is_some_and(|it| it.task.is_some())
}

/// Returns the monotonic time.
pub fn now() -> Instant {
    here().map_or_else(Instant::now, |it| it.simulation.instant())
}

/// Returns the time of day, which may be set.
pub fn wall_time() -> SystemTime {
    here().map_or_else(SystemTime::now, |it| it.simulation.wall_time())
}

/// Returns the simulated result of `stat`.
pub fn stat(told: Stat) -> Stat {
    here().map_or(told, |it| it.simulation.stat(told))
}

/// Returns the key by which files are distributed: the path without the directory of this run.
pub fn place(path: &Path) -> &Path {
    let root = here().map(|it| it.simulation.world().disk.root.clone());
    root.and_then(|root| path.strip_prefix(root).ok())
        .unwrap_or(path)
}

/// Marks a point at which other threads may run. The caller holds no lock, except at the steps
/// while files are read. At those steps only writers of files may intervene.
pub fn step(what: &'static str, path: &Path) {
    let Some(here) = here() else { return };
    let Some(task) = &here.task else { return };
    if std::thread::panicking() {
        return;
    }
    here.simulation.reaches(what, path);
    if matches!(what, "read" | "built" | "published") {
        here.simulation.user_meddles();
    } else {
        task.stop(State::Ready);
        here.simulation.goes_on(what, path);
    }
}

/// Returns the disk's answer to a write: now and then an I/O error.
pub fn disk() -> io::Result<()> {
    let is_broken = here().is_some_and(|it| it.task.is_some() && it.simulation.disk_breaks());
    match is_broken {
        true => Err(io::Error::from(rustix::io::Errno::IO)),
        false => Ok(()),
    }
}

/// Works as [`mpsc::channel`].
pub fn channel<T>() -> (Sender<T>, Receiver<T>) {
    let (sender, receiver) = mpsc::channel();
    let signal = Signal::default();
    (Sender(sender, signal.clone()), Receiver(receiver, signal))
}

/// Counterpart of [`mpsc::Sender`].
pub struct Sender<T>(mpsc::Sender<T>, Signal);

impl<T> std::fmt::Debug for Sender<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl<T> Clone for Sender<T> {
    fn clone(&self) -> Sender<T> {
        Sender(self.0.clone(), self.1.clone())
    }
}

impl<T> Sender<T> {
    /// Works as [`mpsc::Sender::send`].
    pub fn send(&self, value: T) -> Result<(), mpsc::SendError<T>> {
        self.1.store(true, Ordering::Relaxed);
        self.0.send(value)
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        // This may have been the last sender.
        self.1.store(true, Ordering::Relaxed);
    }
}

/// Counterpart of [`mpsc::Receiver`].
pub struct Receiver<T>(mpsc::Receiver<T>, Arc<AtomicBool>);

impl<T> Receiver<T> {
    /// Works as [`mpsc::Receiver::try_recv`].
    pub fn try_recv(&self) -> Result<T, TryRecvError> {
        self.0.try_recv()
    }

    /// Works as [`mpsc::Receiver::recv`].
    pub fn recv(&self) -> Result<T, RecvError> {
        let Some(task) = here().and_then(|it| it.task) else {
            return self.0.recv();
        };
        task.stop(State::Ready);
        loop {
            self.1.store(false, Ordering::Relaxed);
            match self.0.try_recv() {
                Ok(value) => return Ok(value),
                Err(TryRecvError::Disconnected) => return Err(RecvError),
                Err(TryRecvError::Empty) => task.stop(State::Asleep(self.1.clone(), None)),
            }
        }
    }

    /// Works as [`mpsc::Receiver::recv_timeout`].
    pub fn recv_timeout(&self, timeout: Duration) -> Result<T, RecvTimeoutError> {
        let here = here();
        let simulated = here.and_then(|it| Some((it.simulation, it.task?)));
        let Some((simulation, task)) = simulated else {
            return self.0.recv_timeout(timeout);
        };
        let until = simulation.now() + timeout;
        task.stop(State::Ready);
        loop {
            self.1.store(false, Ordering::Relaxed);
            match self.0.try_recv() {
                Ok(value) => return Ok(value),
                Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
                Err(TryRecvError::Empty) if simulation.now() >= until => {
                    return Err(RecvTimeoutError::Timeout);
                }
                Err(TryRecvError::Empty) => task.stop(State::Asleep(self.1.clone(), Some(until))),
            }
        }
    }
}

/// Runs `body` on another thread.
pub fn spawn_blocking<R: Send + 'static>(body: impl FnOnce() -> R + Send + 'static) {
    match here() {
        Some(here) => here
            .simulation
            .spawn("aside".to_owned(), Box::new(move || drop(body()))),
        None => drop(tokio::task::spawn_blocking(body)),
    }
}

/// Counterpart of [`std::thread`].
pub mod thread {
    use std::io;

    use crate::simulation::threads::here;

    pub use std::thread::sleep;

    /// Counterpart of [`std::thread::Builder`].
    #[derive(Default)]
    pub struct Builder(String);

    impl Builder {
        /// Works as the original.
        pub fn new() -> Builder {
            Builder::default()
        }

        /// Works as the original.
        pub fn name(self, name: String) -> Builder {
            Builder(name)
        }

        /// Works as the original.
        pub fn spawn(self, body: impl FnOnce() + Send + 'static) -> io::Result<JoinHandle<()>> {
            let Some(here) = here() else {
                let thread = std::thread::Builder::new().name(self.0);
                return thread.spawn(body).map(|it| JoinHandle(Some(it)));
            };
            here.simulation.spawn(self.0, Box::new(body));
            Ok(JoinHandle(None))
        }
    }

    /// Counterpart of [`std::thread::JoinHandle`]. It does not wait for simulated threads, because
    /// a simulated broker is killed.
    #[derive(Debug)]
    pub struct JoinHandle<T>(Option<std::thread::JoinHandle<T>>);

    impl JoinHandle<()> {
        /// Works as the original.
        pub fn is_finished(&self) -> bool {
            self.0
                .as_ref()
                .is_none_or(std::thread::JoinHandle::is_finished)
        }

        /// Works as the original.
        pub fn join(self) -> std::thread::Result<()> {
            self.0.map_or(Ok(()), std::thread::JoinHandle::join)
        }
    }
}

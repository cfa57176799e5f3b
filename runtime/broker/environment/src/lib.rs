//! Environment of the broker: time, threads, channels between threads, file events of the kernel,
//! and the steps of a job. By default this is the system. A test can replace it for its own threads
//! with [`enter`]. A simulation then runs one thread at a time, in an order that a seed determines.

mod channel;
mod kernel;
mod simulation;
pub mod thread;

use std::io;
use std::path::Path;
use std::time::{Instant, SystemTime};

use qcbus_ingest::Stat;

pub use channel::{Receiver, Sender, channel};
pub use kernel::{Bell, FileEvent, Inotify, Kernel};
use simulation::current;
pub use simulation::{Signal, Simulation, enter};

/// Checks whether the current thread is simulated.
pub fn is_simulated() -> bool {
    current().is_some_and(|it| it.is_thread())
}

/// Returns the monotonic time.
pub fn now() -> Instant {
    current().map_or_else(Instant::now, |it| it.now())
}

/// Returns the time of day, which may be adjusted.
pub fn wall_time() -> SystemTime {
    current().map_or_else(SystemTime::now, |it| it.wall_time())
}

/// Returns the times of a file as reported by `stat`. A simulation replaces them.
pub fn stat(told: Stat) -> Stat {
    current().map_or(told, |it| it.stat(told))
}

/// Returns the key that distinguishes files when they are distributed: the path. In a simulation it
/// lacks the directory of the run, which differs between runs.
pub fn place(path: &Path) -> &Path {
    current().map_or(path, |it| it.place(path))
}

/// Marks a point at which a simulation may run other threads. The caller must hold no lock.
pub fn step(what: &'static str, path: &Path) {
    if let Some(it) = current() {
        it.step(what, path);
    }
}

/// Logs that a file has reached a stage, to measure its processing time:
/// `QCBUS_LOG=qcbus_broker::stages=debug`. The timestamps are those of the log.
pub fn reached(stage: &'static str, path: &Path) {
    tracing::debug!(target: "qcbus_broker::stages", stage, path = %path.display());
    step(stage, path);
}

/// Returns a simulated disk error. The system never has one.
///
/// # Errors
/// The error that the simulation wants.
pub fn disk() -> io::Result<()> {
    current().map_or(Ok(()), |it| it.disk())
}

/// Runs `body` on another thread, which may block.
pub fn spawn_blocking<R: Send + 'static>(body: impl FnOnce() -> R + Send + 'static) {
    match current() {
        Some(it) => it.spawn("aside".to_owned(), Box::new(move || drop(body()))),
        None => drop(tokio::task::spawn_blocking(body)),
    }
}

//! Replacement of the environment by a simulation, for the threads of a test.

use std::cell::RefCell;
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Instant, SystemTime};

use qcbus_ingest::Stat;

use crate::kernel::{FileEvent, Inotify};

/// Signal to a waiting thread that something has arrived. The waiting thread resets it.
pub type Signal = Arc<AtomicBool>;

/// The environment of one thread of a simulation.
pub trait Simulation: Send + Sync {
    /// Checks whether this is a simulated thread. The thread that plays the simulation is none.
    fn is_thread(&self) -> bool;
    /// Returns the monotonic time.
    fn now(&self) -> Instant;
    /// Returns the time of day.
    fn wall_time(&self) -> SystemTime;
    /// Returns the simulated times of a file.
    fn stat(&self, told: Stat) -> Stat;
    /// Returns the part of a path that is the same in every run.
    fn place<'p>(&self, path: &'p Path) -> &'p Path;
    /// Marks a point at which other threads may run.
    fn step(&self, what: &'static str, path: &Path);
    /// Returns an error if the disk fails now.
    ///
    /// # Errors
    /// The error of the disk.
    fn disk(&self) -> io::Result<()>;
    /// Starts a thread.
    fn spawn(&self, name: String, body: Box<dyn FnOnce() + Send>);
    /// Lets other threads run.
    fn pause(&self);
    /// Waits until the signal is set or the time has come.
    fn wait(&self, signal: &Signal, until: Option<Instant>);
    /// Takes over the file events of a queue of the kernel.
    fn take_over(&self, kernel: Arc<Inotify>);
    /// Returns the file events that have arrived.
    fn file_events(&self) -> Vec<FileEvent>;
    /// Takes the signal that wakes the watcher.
    fn bell(&self, signal: Signal);
}

thread_local! {
    static CURRENT: RefCell<Option<Arc<dyn Simulation>>> = const { RefCell::new(None) };
}

/// Returns the simulation of the current thread, if any.
pub(crate) fn current() -> Option<Arc<dyn Simulation>> {
    CURRENT.with_borrow(Clone::clone)
}

/// Replaces the environment of the current thread by a simulation, or by the system.
pub fn enter(simulation: Option<Arc<dyn Simulation>>) {
    CURRENT.set(simulation);
}

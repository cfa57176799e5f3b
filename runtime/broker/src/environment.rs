//! Environment of the broker: the sources of time, threads, kernel events and surrounding
//! processes. By default this is the system. In unit tests a running simulation can replace it (see
//! `simulation`). Then one thread plays all concurrent events in an order that a seed determines.

#[cfg(not(test))]
mod system {
    use std::io;
    use std::path::Path;
    use std::time::{Instant, SystemTime};

    use qcbus_ingest::Stat;

    pub use std::sync::mpsc::{Receiver, Sender, channel};
    pub use std::thread;

    pub use crate::control::ControlSocket;
    pub use crate::supervise::Children;
    pub use crate::watch::kernel::{Bell, Kernel};
    pub use qcbus_bus::Host;
    pub use tokio::task::spawn_blocking;

    /// Checks whether the environment is simulated.
    pub fn is_simulated() -> bool {
        false
    }

    /// Returns the monotonic time.
    pub fn now() -> Instant {
        Instant::now()
    }

    /// Returns the time of day, which may be adjusted.
    pub fn wall_time() -> SystemTime {
        SystemTime::now()
    }

    /// Returns the times of a file as reported by `stat`.
    pub fn stat(told: Stat) -> Stat {
        told
    }

    /// Returns the key that distinguishes files when they are distributed: the path.
    pub fn place(path: &Path) -> &Path {
        path
    }

    /// Marks a point at which the simulation may run other threads. The caller must hold no lock.
    pub fn step(_what: &'static str, _path: &Path) {}

    /// Returns a simulated disk error. The system never has one.
    pub fn disk() -> io::Result<()> {
        Ok(())
    }
}

#[cfg(not(test))]
pub use system::*;

#[cfg(test)]
pub use crate::simulation::environment::*;

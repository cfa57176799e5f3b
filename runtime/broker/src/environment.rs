//! Where time, threads, the kernel's tellings and the processes around the broker come from: the
//! system. Built for its unit tests, the broker takes them from a simulation where one runs (see
//! `simulation`), so that one thread can play all that happens at once, in an order that a seed
//! gives.

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

    /// Whether all this is simulated.
    pub fn is_simulated() -> bool {
        false
    }

    /// The time that passes.
    pub fn now() -> Instant {
        Instant::now()
    }

    /// The time of the day, which may be set.
    pub fn wall_time() -> SystemTime {
        SystemTime::now()
    }

    /// What `stat` says of the times of a file.
    pub fn stat(told: Stat) -> Stat {
        told
    }

    /// What tells files apart when they are shared out: the path.
    pub fn place(path: &Path) -> &Path {
        path
    }

    /// Here others may come in between. No lock is held by who calls it.
    pub fn step(_what: &'static str, _path: &Path) {}

    /// What the disk answers before it is asked: nothing.
    pub fn disk() -> io::Result<()> {
        Ok(())
    }
}

#[cfg(not(test))]
pub use system::*;

#[cfg(test)]
pub use crate::simulation::environment::*;

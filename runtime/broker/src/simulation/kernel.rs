//! The kernel that tells the simulated broker of files: it is the real one, but what it tells is passed
//! on when the schedule says so, or never.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use rustix::fs::inotify::ReadFlags;
use rustix::io::Errno;

use super::Simulation;
use super::threads::{Signal, State, here};
use crate::watch::kernel::{self, Told};

/// Who is asked for events.
pub enum Kernel {
    Real(kernel::Kernel),
    Simulated(Arc<kernel::Kernel>, Arc<Simulation>),
}

impl std::fmt::Debug for Kernel {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Kernel").finish_non_exhaustive()
    }
}

impl Kernel {
    pub fn open() -> io::Result<Kernel> {
        let real = kernel::Kernel::open()?;
        let Some(here) = here() else {
            return Ok(Kernel::Real(real));
        };
        let real = Arc::new(real);
        here.simulation.world().disk.telling.kernel = Some(real.clone());
        Ok(Kernel::Simulated(real, here.simulation))
    }

    fn real(&self) -> &kernel::Kernel {
        match self {
            Kernel::Real(real) => real,
            Kernel::Simulated(real, _) => real,
        }
    }

    pub fn watch(&self, directory: &Path) -> Result<i32, Errno> {
        self.real().watch(directory)
    }

    pub fn forget(&self, watch: i32) {
        self.real().forget(watch);
    }

    pub fn events(&self) -> io::Result<Vec<Told>> {
        match self {
            Kernel::Real(real) => real.events(),
            Kernel::Simulated(_, it) => Ok(std::mem::take(&mut it.world().disk.telling.told)),
        }
    }
}

/// What wakes the watcher.
pub enum Bell {
    Real(kernel::Bell),
    Simulated(Signal),
}

impl std::fmt::Debug for Bell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bell").finish_non_exhaustive()
    }
}

impl Bell {
    pub fn new() -> io::Result<Bell> {
        let Some(here) = here() else {
            return kernel::Bell::new().map(Bell::Real);
        };
        let signal = Signal::default();
        here.simulation.world().disk.telling.bell = signal.clone();
        Ok(Bell::Simulated(signal))
    }

    pub fn ring(&self) {
        match self {
            Bell::Real(real) => real.ring(),
            Bell::Simulated(signal) => signal.store(true, Ordering::Relaxed),
        }
    }

    pub fn wait(&self, kernel: Option<&Kernel>, rest: Duration) {
        let signal = match self {
            Bell::Real(real) => return real.wait(kernel.map(Kernel::real), rest),
            Bell::Simulated(signal) => signal,
        };
        let here = here();
        let Some((simulation, task)) = here.and_then(|it| Some((it.simulation, it.task?))) else {
            return;
        };
        let until = simulation.now() + rest;
        task.stop(State::Asleep(signal.clone(), Some(until)));
        signal.store(false, Ordering::Relaxed);
    }
}

/// What the kernel has to tell.
#[derive(Default)]
pub struct Telling {
    /// Who is asked, if anybody.
    kernel: Option<Arc<kernel::Kernel>>,
    /// What it has not told yet.
    waiting: std::collections::VecDeque<Told>,
    /// What it has, and nobody has taken.
    told: Vec<Told>,
    bell: Signal,
}

impl Telling {
    /// Takes what the real one says of what has just been done.
    pub fn hear(&mut self) {
        let Some(kernel) = &self.kernel else { return };
        self.waiting
            .extend(kernel.events().expect("the kernel tells"));
    }

    /// Nobody is told of what has just been done.
    pub fn drop_new(&mut self, of: usize) {
        self.hear();
        self.waiting.truncate(of);
    }

    pub fn count(&mut self) -> usize {
        self.hear();
        self.waiting.len()
    }

    /// The queue of the kernel is full.
    pub fn overflow(&mut self) {
        self.hear();
        self.waiting.clear();
        if self.kernel.is_some() {
            self.waiting.push_back(Told {
                watch: -1,
                what: ReadFlags::QUEUE_OVERFLOW,
                name: None,
            });
        }
    }

    /// The next event is told; gives how it reads.
    pub fn tell(&mut self) -> Option<String> {
        self.hear();
        let event = self.waiting.pop_front()?;
        let said = format!("{:?} {:?} of {}", event.what, event.name, event.watch);
        self.told.push(event);
        self.bell.store(true, Ordering::Relaxed);
        Some(said)
    }

    /// The broker is dead.
    pub fn forget(&mut self) {
        *self = Telling::default();
    }
}

//! The source of file events for the simulated broker: it is the real kernel, but the schedule
//! decides when events are passed on, or that they are lost.

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

/// Source of file events.
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

/// Wakes the watcher.
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

/// Queue of kernel events of the simulation.
#[derive(Default)]
pub struct Telling {
    /// Real kernel that provides the events, if the broker has opened it.
    kernel: Option<Arc<kernel::Kernel>>,
    /// Events that are not passed on yet.
    waiting: std::collections::VecDeque<Told>,
    /// Events that are passed on but not read yet.
    told: Vec<Told>,
    bell: Signal,
}

impl Telling {
    /// Takes over the real kernel's events about the latest changes.
    pub fn hear(&mut self) {
        let Some(kernel) = &self.kernel else { return };
        self.waiting
            .extend(kernel.events().expect("the kernel reports events"));
    }

    /// Drops the events about the latest changes: only the first `of` events stay.
    pub fn drop_new(&mut self, of: usize) {
        self.hear();
        self.waiting.truncate(of);
    }

    pub fn count(&mut self) -> usize {
        self.hear();
        self.waiting.len()
    }

    /// Simulates a full event queue of the kernel.
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

    /// Passes the next event on and returns its text.
    pub fn tell(&mut self) -> Option<String> {
        self.hear();
        let event = self.waiting.pop_front()?;
        let said = format!("{:?} {:?} of {}", event.what, event.name, event.watch);
        self.told.push(event);
        self.bell.store(true, Ordering::Relaxed);
        Some(said)
    }

    /// Drops all state because the broker is dead.
    pub fn forget(&mut self) {
        *self = Telling::default();
    }
}

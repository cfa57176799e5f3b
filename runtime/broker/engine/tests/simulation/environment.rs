//! The environment of the simulated threads.

use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use qcbus_environment::{FileEvent, Inotify, Signal};
use qcbus_ingest::Stat;

use super::threads::{Here, State};

impl qcbus_environment::Simulation for Here {
    fn is_thread(&self) -> bool {
        self.task.is_some()
    }

    fn now(&self) -> Instant {
        self.simulation.instant()
    }

    fn wall_time(&self) -> SystemTime {
        self.simulation.wall_time()
    }

    fn stat(&self, told: Stat) -> Stat {
        self.simulation.stat(told)
    }

    fn place<'p>(&self, path: &'p Path) -> &'p Path {
        let root = self.simulation.world().disk.root.clone();
        path.strip_prefix(root).unwrap_or(path)
    }

    /// The caller holds no lock, except at the steps while files are read. At those steps only
    /// writers of files may intervene.
    fn step(&self, what: &'static str, path: &Path) {
        let Some(task) = &self.task else { return };
        if std::thread::panicking() {
            return;
        }
        self.simulation.reaches(what, path);
        if matches!(what, "read" | "built" | "published") {
            self.simulation.user_meddles();
        } else {
            task.stop(State::Ready);
            self.simulation.goes_on(what, path);
        }
    }

    fn disk(&self) -> io::Result<()> {
        match self.is_thread() && self.simulation.disk_breaks() {
            true => Err(io::Error::from(rustix::io::Errno::IO)),
            false => Ok(()),
        }
    }

    fn spawn(&self, name: String, body: Box<dyn FnOnce() + Send>) {
        self.simulation.spawn(name, body);
    }

    fn pause(&self) {
        if let Some(task) = &self.task {
            task.stop(State::Ready);
        }
    }

    fn wait(&self, signal: &Signal, until: Option<Instant>) {
        let start = self.simulation.world().start;
        let until = until.map(|it| it.saturating_duration_since(start));
        if let Some(task) = &self.task {
            task.stop(State::Asleep(signal.clone(), until));
        }
    }

    fn take_over(&self, kernel: Arc<Inotify>) {
        self.simulation.world().disk.telling.kernel = Some(kernel);
    }

    fn file_events(&self) -> Vec<FileEvent> {
        std::mem::take(&mut self.simulation.world().disk.telling.told)
    }

    fn bell(&self, signal: Signal) {
        self.simulation.world().disk.telling.bell = signal;
    }
}

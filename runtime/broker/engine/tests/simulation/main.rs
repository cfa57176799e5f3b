//! The broker in a simulated world: its loop, watcher, writers, readers, journal and start are real, on threads of
//! which one runs at a time. A seed determines the next thread, the clock, changes of files, answers of bundles,
//! events of the kernel and kills of the broker. The files are real, too, in a directory in memory. Time, the bus,
//! processes and the delivery of kernel events are not real.
//!
//! `QCBUS_SIM_SEED=7` plays one schedule and prints it, `QCBUS_SIM_SCHEDULES=10000` plays as many,
//! `QCBUS_SIM_FROM=1000000` begins with that seed.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    missing_docs,
    reason = "this is all test code, including functions without `#[test]`"
)]

mod backend;
mod broker;
mod disk;
mod environment;
mod kernel;
mod oracle;
mod peers;
mod schedule;
mod tests;
mod threads;
mod world;

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use qcbus_bus::{Documents, MappedImage};
use qcbus_ingest::Stat;
use qcbus_messages::{DocId, JobId};
use qcbus_state::Summary;

use threads::{Crew, State, Steps, here};
use world::Serving;
use world::World;

/// A schedule that is being played.
pub struct Simulation {
    world: Mutex<World>,
    crew: Arc<Crew>,
    documents: Documents,
    steps: Steps,
}

impl Simulation {
    pub fn world(&self) -> MutexGuard<'_, World> {
        self.world.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn now(&self) -> Duration {
        self.world().now
    }

    pub fn instant(&self) -> Instant {
        let world = self.world();
        world.start + world.now
    }

    pub fn wall_time(&self) -> SystemTime {
        let since = u64::try_from(self.world().wall_now()).unwrap_or_default();
        UNIX_EPOCH + Duration::from_nanos(since)
    }

    pub fn stat(&self, told: Stat) -> Stat {
        self.world().disk.stat(told)
    }

    /// Runs `body` on a simulated thread when the schedule selects it.
    pub fn spawn(self: &Arc<Simulation>, name: String, body: Box<dyn FnOnce() + Send>) {
        let task = self.crew.start(self, name, body);
        self.world().tasks.push(task);
    }

    /// Records that a thread has reached a step.
    pub fn reaches(&self, what: &'static str, path: &Path) {
        let mut world = self.world();
        world.say(|| format!("  {what} {}", name_of(path)));
        match what {
            "named" => world.verdict_is_written(path),
            "pooled" => world.stored += 1,
            _ => {}
        }
    }

    /// Records that a thread continues after a step.
    pub fn goes_on(&self, what: &'static str, path: &Path) {
        let mut world = self.world();
        let step = world.step;
        match what {
            "storing" => world.scanner.looks(path, step),
            "pooled" => world.scanner.asks(path, step),
            _ => {}
        }
    }

    /// May change a file while another one is being read.
    pub fn user_meddles(&self) {
        let mut world = self.world();
        if world.meddles && world.rng.u32(0..12) == 0 {
            world.deed();
        }
    }

    /// Decides whether a disk operation fails this time. It never fails while a broker starts.
    pub fn disk_breaks(&self) -> bool {
        let mut world = self.world();
        let breaks = world.meddles && world.serving.is_some() && world.rng.u32(0..40) == 0;
        if breaks {
            world.say(|| "  the disk does not respond".to_owned());
        }
        breaks
    }

    pub fn images(&self, job: JobId) -> Vec<(DocId, MappedImage)> {
        let intake = self.world().serving.as_ref().map(|it| it.intake.clone());
        intake.map(|it| it.images(job)).unwrap_or_default()
    }
}

fn name_of(path: &Path) -> String {
    let parts: Vec<_> = path.iter().rev().take(2).collect();
    let parts: Vec<_> = parts
        .into_iter()
        .rev()
        .map(|it| it.to_string_lossy())
        .collect();
    parts.join("/")
}

/// Replaces the point at which the loop of a real broker waits for events.
pub struct Turns {
    simulation: Arc<Simulation>,
}

impl Turns {
    /// Begins the loop.
    pub fn begin(serving: Serving) -> Turns {
        let simulation = here().expect("a simulated thread").simulation;
        simulation.world().serving = Some(serving);
        Turns { simulation }
    }

    pub fn now(&self) -> Duration {
        self.simulation.now()
    }

    /// Chooses a number below `count`.
    pub fn choose(&self, count: usize) -> usize {
        self.simulation.world().rng.usize(0..count)
    }

    pub fn say(&self, line: impl FnOnce() -> String) {
        self.simulation.world().say(line);
    }

    /// Ends an iteration of the loop.
    pub fn is_over(&self, summary: Summary) {
        let mut world = self.simulation.world();
        if summary.required.iter().any(|it| it == peers::SECOND) {
            let step = world.step;
            world.peers.second_since.get_or_insert(step);
        }
        world.summary = summary;
        drop(world);
        self.stop(State::Ready);
    }

    /// Pauses because no work exists before `until`.
    pub fn rest(&self, until: Duration) {
        self.stop(State::AtRest(self.simulation.steps.count(), until));
    }

    fn stop(&self, state: State) {
        if let Some(task) = here().and_then(|it| it.task) {
            task.stop(state);
        }
    }
}

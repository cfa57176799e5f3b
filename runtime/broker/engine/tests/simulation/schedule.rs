//! A schedule: the sequence of events that a seed determines.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use qcbus_broker::Options;
use qcbus_bus::{Documents, HostOptions, Instance};
use qcbus_types::Settings;
use qcbus_watch::OPEN_QUIET;

use super::Simulation;
use super::broker::{line_of, simulate};
use super::peers::{FIRST, REPORTER, SECOND, children};
use super::threads::{Crew, Here, SimulatedThread, State, Steps, enter};
use super::world::World;

/// Resources shared by many schedules, one after the other.
pub struct Stage {
    pub crew: Arc<Crew>,
    pub documents: Documents,
    pub dir: PathBuf,
}

/// A schedule that violated an invariant.
#[derive(Debug)]
pub struct Wrong {
    pub what: String,
    pub lines: Vec<String>,
}

/// Statistics of a schedule.
#[derive(Debug, Default, Clone, Copy)]
pub struct Figures {
    pub steps: usize,
    pub kills: u64,
    pub stored: usize,
    pub virtual_seconds: f64,
}

/// Maximum number of half seconds until everything has settled. If the clock jumps by a minute or
/// two during a full scan, the next scan follows after four times as long.
const ROUNDS: usize = 1_200;

/// Maximum number of steps until the world is at rest. More steps mean that it never comes to rest.
const MOST_STEPS: usize = 30_000;

struct Play {
    simulation: Arc<Simulation>,
    options: Options,
    kills: u64,
}

/// Plays a schedule, and records it if `verbose` is set.
pub fn play(stage: &Stage, seed: u64, verbose: bool) -> Result<(Figures, Vec<String>), Wrong> {
    let dir = stage.dir.join(format!("{seed}"));
    let root = dir.join("farm");
    for made in [root.join("sub"), dir.join("i")] {
        std::fs::create_dir_all(made).expect("the directory can be created");
    }
    let mut world = World::new(seed, root, dir.join("out"), dir.join("gate"));
    world.verbose = verbose;
    let simulation = Arc::new(Simulation {
        world: Mutex::new(world),
        crew: stage.crew.clone(),
        documents: stage.documents.clone(),
        steps: Steps::default(),
    });
    enter(Some(Here {
        simulation: simulation.clone(),
        task: None,
    }));
    let mut play = Play {
        options: options(&dir),
        simulation: simulation.clone(),
        kills: 0,
    };
    let ended = play.all();
    play.kill();
    let mut world = simulation.world();
    let (steps, lines) = (world.step, std::mem::take(&mut world.lines));
    let figures = Figures {
        steps,
        kills: play.kills,
        stored: world.stored,
        virtual_seconds: world.now.as_secs_f64(),
    };
    drop(world);
    enter(None);
    // The directory is in memory. If it cannot be removed now, it is removed with all others at the end.
    let _ = std::fs::remove_dir_all(&dir);
    match ended {
        Ok(()) => Ok((figures, lines)),
        Err(what) => Err(Wrong { what, lines }),
    }
}

fn options(dir: &Path) -> Options {
    Options {
        sandbox: false,
        instance: Instance::at(dir.join("i")),
        roots: vec![dir.join("farm")],
        files: Vec::new(),
        watch: true,
        poll: None,
        rescan: Duration::from_secs(5),
        settle: None,
        out: dir.join("out"),
        here: None,
        single_result: None,
        state: Some(dir.join("state")),
        retention: Duration::from_secs(3600),
        choice: Default::default(),
        strict: false,
        all: false,
        dialect: qcbus_formats::xqar::Dialect::default(),
        durable: false,
        verdict_files: true,
        gate: Some(dir.join("gate")),
        gate_outside: qcbus_publish::gate::Outside::default(),
        config: None,
        bundles_d: None,
        standard: children(),
        reporters: Vec::new(),
        known: qcbus_formats::config::Known::default(),
        adapter: qcbus_configuration::Adapter::default(),
        die_with_broker: false,
        memory_limit: None,
        limits: qcbus_ingest::Limits::default(),
        host: HostOptions::default(),
        settings: Settings {
            max_active: 4,
            max_preparing: 2,
            max_storing: 2,
            read_again_after: Duration::from_secs(2),
            ..Settings::default()
        },
    }
}

type Ended = Result<(), String>;

impl Play {
    fn all(&mut self) -> Ended {
        self.prologue();
        // Changes after everything has settled reveal state that was lost.
        for most in [400, 160] {
            let steps = self.with(|world| {
                world.meddles = true;
                world.deed();
                world.rng.usize(most / 4..most)
            });
            for _ in 0..steps {
                self.step()?;
            }
            self.settle()?;
        }
        if self.with(|world| world.rng.u32(0..4)) == 0 {
            self.nothing_is_judged_again()?;
        }
        Ok(())
    }

    fn with<T>(&self, body: impl FnOnce(&mut World) -> T) -> T {
        body(&mut self.simulation.world())
    }

    /// Creates some files before the broker starts.
    fn prologue(&mut self) {
        self.with(|world| {
            for _ in 0..world.rng.usize(0..8) {
                world.deed();
            }
            // Half of the worlds begin with old files.
            if world.rng.bool() {
                world.now += Duration::from_secs(10);
            }
        });
        self.start();
    }

    fn start(&mut self) {
        let mut options = self.options.clone();
        self.with(|world| {
            world.generation += 1;
            options.settings.generation = world.generation;
            options.settings.numbers = world.generation;
            world.say(|| "the broker starts".to_owned());
        });
        let simulation = self.simulation.clone();
        let tell = move |told| {
            if let Some(line) = line_of(&told) {
                simulation.world().say(|| line);
            }
        };
        let its = self.simulation.clone();
        let body = Box::new(move || simulate(&its, &options, tell));
        self.simulation.spawn("loop".to_owned(), body);
    }

    fn is_alive(&self) -> bool {
        self.with(|world| !world.tasks.is_empty())
    }

    fn kill(&mut self) {
        let tasks = self.with(|world| {
            world.asked = None;
            world.serving = None;
            std::mem::take(&mut world.tasks)
        });
        if tasks.is_empty() {
            return;
        }
        self.kills += 1;
        self.with(|world| world.say(|| "the broker is killed".to_owned()));
        for task in tasks {
            task.kill();
        }
        self.with(|world| {
            world.tasks.clear();
            world.peers.are_alone();
            world.disk.telling.forget();
            world.summary = qcbus_state::Summary::default();
            world.hear_answers();
        });
    }

    fn step(&mut self) -> Ended {
        let chance = self.with(|world| world.rng.u32(0..1000));
        match chance {
            0..700 => self.go_on()?,
            700..780 => drop(self.tell_one()),
            780..880 => self.peer_acts(),
            880..930 => self.with(World::deed),
            930..970 => self.time_passes(),
            970..985 => self.with(World::ask),
            985..989 if self.is_alive() => self.kill(),
            989..994 => self.failure(),
            _ => self.somebody_comes(),
        }
        self.with(|world| {
            world.step += 1;
            world.hear_answers();
        });
        self.simulation.steps.next();
        self.verdict_so_far()
    }

    fn verdict_so_far(&self) -> Ended {
        self.with(|world| world.fault.clone().map_or(Ok(()), Err))
    }

    /// Lets one of the threads go on. If it is a writer, the broker may be killed afterwards.
    fn go_on(&mut self) -> Ended {
        let ran = self.run_one()?;
        if ran.is_some_and(|name| name.starts_with("write"))
            && self.with(|it| it.rng.u32(0..60)) == 0
        {
            self.kill();
        }
        Ok(())
    }

    /// Returns the threads that can go on.
    fn runnable(&self) -> Vec<Arc<SimulatedThread>> {
        let count = self.simulation.steps.count();
        let world = self.simulation.world();
        let now = world.now;
        let can = |task: &&Arc<SimulatedThread>| match &*task.state.lock().unwrap() {
            State::Ready => true,
            State::Asleep(signal, until) => {
                signal.load(std::sync::atomic::Ordering::Relaxed)
                    || until.is_some_and(|until| until <= now)
            }
            State::AtRest(since, until) => count > *since || *until <= now,
            State::Ended => false,
        };
        world.tasks.iter().filter(can).cloned().collect()
    }

    /// Lets one of the threads run to its next stop. Returns its name, or `None` if no thread can run.
    fn run_one(&mut self) -> Result<Option<String>, String> {
        let runnable = self.runnable();
        if runnable.is_empty() {
            return Ok(None);
        }
        let at = self.with(|world| world.rng.usize(0..runnable.len()));
        let task = &runnable[at];
        task.resume();
        if let Some(panic) = task.panic.lock().unwrap().clone() {
            return Err(format!("{} panics: {panic}", task.name));
        }
        let rests = matches!(*task.state.lock().unwrap(), State::AtRest(..));
        let mut world = self.simulation.world();
        world.step += 1;
        world.tasks.retain(|it| !it.has_ended());
        // The loop itself changes the disk while it starts.
        if task.name.starts_with("write") || world.serving.is_none() {
            world.gate_is_true();
        }
        world.hear_answers();
        drop(world);
        if !rests {
            self.simulation.steps.next();
        }
        self.verdict_so_far()?;
        Ok(Some(task.name.clone()))
    }

    /// Passes on one event of the kernel. Returns whether there was one.
    fn tell_one(&self) -> bool {
        let told = self.with(|world| {
            let said = world.disk.telling.tell()?;
            world.say(|| format!("the kernel tells: {said}"));
            Some(())
        });
        if told.is_some() {
            self.simulation.steps.next();
        }
        told.is_some()
    }

    fn peer_acts(&self) {
        self.with(|world| {
            let able = world.peers.at_work();
            if able.is_empty() {
                return;
            }
            let pid = able[world.rng.usize(0..able.len())];
            match world.rng.u32(0..40) {
                0 => {
                    world.peers.dies(pid);
                    world.say(|| format!("process {pid} dies"));
                }
                1 => {
                    if let Some(process) = world.peers.processes.get_mut(&pid) {
                        process.hangs = true;
                    }
                    world.say(|| format!("process {pid} hangs"));
                }
                n => {
                    let at_once = world.rng.bool();
                    let text = world.peers.act(pid, n as usize, at_once);
                    world.say(|| text);
                }
            }
        });
    }

    fn somebody_comes(&mut self) {
        if !self.is_alive() {
            return self.start();
        }
        self.with(|world| {
            let n = world.rng.usize(0..8);
            if world.peers.has_starting() && n > 2 {
                world.peers.arrive();
            } else if !world.peers.return_one(n) && !world.peers.is_there(SECOND) {
                world.peers.begin(SECOND, None);
            }
        });
    }

    /// Simulates a failure: the clock is set, the kernel loses events, or hanging processes continue.
    fn failure(&self) {
        self.with(|world| match world.rng.u32(0..6) {
            0 => {
                let hours = world.rng.i32(-2..3);
                world.wall += i128::from(hours) * 3_600_000_000_000;
                world.say(|| format!("the clock is set by {hours} hours"));
            }
            1 => {
                world.disk.telling.overflow();
                world.say(|| "the kernel drops what it had to tell".to_owned());
            }
            2 => {
                let before = world.disk.telling.count();
                world.deed();
                world.disk.telling.drop_new(before);
                world.say(|| "and the kernel tells nobody".to_owned());
            }
            _ => world
                .peers
                .processes
                .values_mut()
                .for_each(|it| it.hangs = false),
        });
    }

    /// Returns the time of the next deadline.
    fn next_due(&self) -> Option<Duration> {
        let world = self.simulation.world();
        let due = |task: &Arc<SimulatedThread>| match &*task.state.lock().unwrap() {
            State::Asleep(_, until) => *until,
            State::AtRest(_, until) => Some(*until),
            _ => None,
        };
        world.tasks.iter().filter_map(due).min()
    }

    fn time_passes(&self) {
        let due = self.next_due();
        self.with(|world| {
            let millis = match world.rng.u32(0..20) {
                0..8 => return world.now = due.unwrap_or_default().max(world.now),
                8..14 => world.rng.u64(1..100),
                14..19 => world.rng.u64(200..1500),
                _ => 30_000,
            };
            world.now += Duration::from_millis(millis);
        });
    }

    /// Connects all processes, stops all disturbances and lets time pass until every invariant holds.
    fn settle(&mut self) -> Ended {
        self.with(|world| {
            world.meddles = false;
            world.say(|| "everything settles".to_owned());
        });
        if !self.is_alive() {
            self.start();
        }
        let mut last = Ok(());
        for round in 0..ROUNDS {
            self.come_to_rest()?;
            // The state must be stable for a while, and checking it costs more than waiting.
            if round > 3 {
                last = self.with(World::unsettled);
                if last.is_ok() {
                    return Ok(());
                }
            }
            self.with(|world| world.now += Duration::from_millis(500));
        }
        last.map_err(|why| format!("it does not settle: {why}"))
    }

    /// Lets everything go on, without time passing, until nothing can run.
    fn come_to_rest(&mut self) -> Ended {
        for _ in 0..MOST_STEPS {
            let acted = self.all_peers_act();
            let told = self.tell_one();
            if self.run_one()?.is_none() && !told && !acted {
                self.with(World::shut_is_shut);
                return self.verdict_so_far();
            }
        }
        Err("it does not come to rest".to_owned())
    }

    fn all_peers_act(&self) -> bool {
        let acted = self.with(|world| {
            world
                .peers
                .processes
                .values_mut()
                .for_each(|it| it.hangs = false);
            let mut acted = world.peers.return_one(0);
            if world.peers.has_starting() {
                world.peers.arrive();
                acted = true;
            }
            if world.generation > 0 && !world.peers.is_there(SECOND) && world.asked.is_some() {
                world.peers.begin(SECOND, None);
                acted = true;
            }
            for pid in world.peers.at_work() {
                let text = world.peers.act(pid, 0, true);
                world.say(|| text);
                acted = true;
            }
            acted
        });
        if acted {
            self.simulation.steps.next();
        }
        acted
    }

    /// Checks that settled results stay valid after a kill, too.
    fn nothing_is_judged_again(&mut self) -> Ended {
        // A file counts as open for this time if the event about its close was lost. Its dependants
        // are judged only after that.
        self.with(|world| world.now += OPEN_QUIET);
        self.settle()?;
        let before = self.with(|world| world.peers.reports.clone());
        self.kill();
        self.start();
        self.settle()?;
        let after = self.with(|world| world.peers.reports.clone());
        let there = self.with(|world| [FIRST, SECOND, REPORTER].map(|it| world.peers.is_there(it)));
        if before == after {
            return Ok(());
        }
        Err(format!(
            "after a kill at rest files are judged again: {before:?}, {after:?}, there: {there:?}"
        ))
    }
}

//! The world around the simulated broker.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use fastrand::Rng;
use qcbus_broker::Intake;
use qcbus_bus::{MappedImage, PeerId};
use qcbus_control::Asked;
use qcbus_messages::control::{Request, Response};
use qcbus_messages::{DocId, ToPeer};
use qcbus_publish::store::Store;
use qcbus_state::Summary;
use tokio::sync::mpsc::UnboundedSender;
use tokio::sync::oneshot;

use super::disk::{Disk, How, JUDGED, Mark};
use super::oracle::Scanner;
use super::peers::{Letter, Peers};
use super::threads::SimulatedThread;

/// Parts of the broker that the simulation inspects.
pub struct Serving {
    pub store: Arc<Store>,
    pub intake: Arc<Intake>,
}

/// A client that waits for a verdict.
pub struct Wait {
    pub file: usize,
    /// Step at which the client asked.
    pub asked: usize,
    pub answer: oneshot::Receiver<Response>,
}

/// The simulated world.
pub struct World {
    pub rng: Rng,
    pub now: Duration,
    pub start: Instant,
    /// Nanoseconds since 1970, minus the simulated time that has passed.
    pub wall: i128,
    pub generation: u64,
    pub disk: Disk,
    pub peers: Peers,
    pub asked: Option<UnboundedSender<Asked>>,
    pub serving: Option<Serving>,
    pub summary: Summary,
    pub waits: Vec<Wait>,
    /// Simulated threads. The loop of the broker comes first.
    pub tasks: Vec<Arc<SimulatedThread>>,
    pub scanner: Scanner,
    /// First violation of an invariant.
    pub fault: Option<String>,
    pub lines: Vec<String>,
    /// Whether the schedule is recorded.
    pub verbose: bool,
    /// Whether files are written while they are read.
    pub meddles: bool,
    pub step: usize,
    pub stored: usize,
}

impl World {
    pub fn new(seed: u64, root: PathBuf, out: PathBuf, gate: PathBuf) -> World {
        World {
            rng: Rng::with_seed(seed),
            now: Duration::ZERO,
            start: Instant::now(),
            wall: 1_800_000_000_000_000_000,
            generation: 0,
            disk: Disk::new(root),
            peers: Peers::default(),
            asked: None,
            serving: None,
            summary: Summary::default(),
            waits: Vec::new(),
            tasks: Vec::new(),
            scanner: Scanner::new(out, gate),
            fault: None,
            lines: Vec::new(),
            verbose: false,
            meddles: false,
            step: 0,
            stored: 0,
        }
    }

    /// Records a line of the schedule.
    pub fn say(&mut self, line: impl FnOnce() -> String) {
        if !self.verbose {
            return;
        }
        let root = self
            .disk
            .root
            .parent()
            .map(|it| format!("{}/", it.display()));
        let line = line().replace(&root.unwrap_or_default(), "");
        let line = format!("{:5} {:>9.3} {}", self.step, self.now.as_secs_f64(), line);
        self.lines.push(line);
    }

    /// Records a violation of an invariant.
    pub fn wrong(&mut self, what: String) {
        self.say(|| format!("WRONG: {what}"));
        self.fault.get_or_insert(what);
    }

    pub fn wall_now(&self) -> i128 {
        self.wall + i128::try_from(self.now.as_nanos()).unwrap_or(i128::MAX)
    }

    /// Delivers a message to a peer.
    pub fn told(&mut self, peer: PeerId, message: &ToPeer, images: &[(DocId, MappedImage)]) {
        match message {
            ToPeer::Job(job) => self.peers.has_job(peer, job, images),
            ToPeer::Cancel { job } => {
                let heard = self.rng.bool();
                self.peers.cancelled(peer, *job, heard);
            }
            ToPeer::Result(result) => {
                let letter = Letter::Write(result.input.clone(), result.job);
                self.peers.has_letter(peer, letter);
            }
            ToPeer::Withdrawn(gone) => {
                let letter = Letter::TakeBack(gone.input.clone());
                self.peers.has_letter(peer, letter);
            }
            ToPeer::Drain => self.peers.is_told_to_go(peer),
            ToPeer::Welcome { .. } | ToPeer::Refused { .. } => {}
        }
    }

    /// Makes a random change to the files.
    pub fn deed(&mut self) {
        let step = self.step;
        let at = (step, self.wall_now());
        let file = self.rng.usize(0..super::disk::FILES.len());
        let name = super::disk::FILES[file];
        let chance = self.rng.u32(0..100);
        let is_there = self.disk.lying[file].is_some();
        match chance {
            0..15 if is_there => {
                self.disk.remove(file, step);
                self.say(|| format!("{name} is removed"));
            }
            15..22 => {
                let to = if file < 2 { 1 - file } else { file };
                self.disk.rename(file, to, at);
                self.say(|| format!("{name} takes the place of its like"));
            }
            22..27 => {
                self.disk.move_directory(step);
                self.say(|| "sub is moved".to_owned());
            }
            _ => {
                let mark = [Mark::Good, Mark::Good, Mark::Good, Mark::Bad, Mark::Unfit];
                let mark = mark[self.rng.usize(0..mark.len())];
                let how = self.how();
                self.disk.write(file, at, mark, how);
                self.say(|| format!("{name} is written: {mark:?} {how:?}"));
            }
        }
    }

    fn how(&mut self) -> How {
        match self.rng.u32(0..20) {
            0..6 => How::InPlace,
            6..8 => How::TimePutBack,
            8..13 => How::Renamed,
            13..15 => How::Torn,
            15..17 => How::Again,
            _ => How::Touched,
        }
    }

    /// Lets a client ask for a verdict.
    pub fn ask(&mut self) {
        let Some(asked) = &self.asked else { return };
        let file = self.rng.usize(JUDGED);
        let (answer, receiver) = oneshot::channel();
        let request = Request::Wait {
            file: self.disk.path(file),
            timeout_ms: None,
        };
        if asked.send(Asked { request, answer }).is_ok() {
            self.say(|| format!("somebody waits for {}", super::disk::FILES[file]));
            self.waits.push(Wait {
                file,
                asked: self.step,
                answer: receiver,
            });
        }
    }
}

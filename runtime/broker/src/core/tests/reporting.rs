//! The reporter of a random world: a child that writes what it is told, some time.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use qcbus_messages::{FromPeer, Hello, JobId, PROTOCOL_VERSION, PeerReport, Role};

use super::super::*;
use super::things::{file_of, path_of};
use super::world::World;

pub const REPORTER: &str = "text";

/// What a reporter was told and has not answered.
#[derive(Debug, Clone, Copy)]
enum Letter {
    Result(u8, JobId),
    Gone(u8),
}

/// Everything about the reporter, its processes, and what the journal knows of it.
#[derive(Default)]
pub struct Requests {
    /// Whether this world has a reporter.
    pub open: bool,
    processes: BTreeMap<SessionId, VecDeque<Letter>>,
    /// What lies on the desk: of which job the report on each file is.
    pub reports: BTreeMap<u8, JobId>,
    /// What was ever written.
    written: BTreeSet<JobId>,
    /// What the journal has been told.
    pub delivered: BTreeMap<u8, JobId>,
    pub voids: BTreeSet<u8>,
}

pub fn reporter() -> ChildSpec {
    ChildSpec {
        name: REPORTER.to_owned(),
        role: Role::Reporter,
        version: None,
        command: vec!["text".to_owned()],
        restart: Restart::Always,
        may: Default::default(),
        programs: Vec::new(),
        shadow: false,
        slow_start: false,
    }
}

impl World {
    /// A world with a reporter.
    pub fn with_a_reporter() -> World {
        let mut world = World::new();
        world.requests.open = true;
        world.manifest(None);
        world
    }

    /// What the reporter and the journal learn of an action.
    pub fn requests_hear(&mut self, action: &Action) {
        match action {
            Action::Deliver {
                session, delivery, ..
            } => {
                let file = file_of(&delivery.path);
                let about = |it: &Letter| matches!(it, Letter::Result(it, _) if *it == file);
                assert!(
                    !self.requests.processes.values().flatten().any(about),
                    "two results of one file are not under way side by side"
                );
                let process = self.requests.processes.get_mut(session);
                let process = process.expect("no result goes to a closed session");
                process.push_back(Letter::Result(file, delivery.job));
            }
            Action::Void { session, path, .. } => {
                let process = self.requests.processes.get_mut(session);
                let process = process.expect("nothing goes to a closed session");
                // What is read back only now is not sent any more.
                let file = file_of(path);
                process.retain(|it| !matches!(it, Letter::Result(it, _) if *it == file));
                process.push_back(Letter::Gone(file));
            }
            Action::Delivered { path, job, .. } => {
                assert!(self.requests.written.contains(job), "only what was written");
                self.requests.delivered.insert(file_of(path), *job);
            }
            Action::Voided { path, .. } => {
                assert!(!self.requests.reports.contains_key(&file_of(path)));
                self.requests.voids.remove(&file_of(path));
            }
            Action::Withdraw { path, reporters } => {
                self.requests.delivered.remove(&file_of(path));
                if !reporters.is_empty() {
                    self.requests.voids.insert(file_of(path));
                }
            }
            Action::Disconnect { session } | Action::Refuse { session, .. } => {
                self.requests.processes.remove(session);
            }
            _ => {}
        }
    }

    /// The process that was started for the reporter says hello.
    pub fn reporter_joins(&mut self, launch: Launch) {
        self.sessions += 1;
        let session = SessionId(self.sessions);
        self.requests.processes.insert(session, VecDeque::new());
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            role: Role::Reporter,
            name: REPORTER.to_owned(),
            version: "1".to_owned(),
            incarnation: self.sessions,
            pid: u32::try_from(self.sessions).unwrap() + 1000,
            launch: Some(launch.0),
            capacity: 2,
            threads: 1,
        };
        self.event(Event::Hello { session, hello });
    }

    /// The reporter does the next thing that it was told. `heard`: it lives to say so.
    pub fn report(&mut self, heard: bool) {
        let Some((session, letters)) = self.requests.processes.iter_mut().next() else {
            return;
        };
        let (session, letter) = (*session, letters.pop_front());
        let report = PeerReport::Written;
        let message = match letter {
            None => return,
            Some(Letter::Result(file, job)) => {
                // It is read back from the disk, where another may lie by now.
                if self.journal.get(&file).map(|it| it.job) != Some(job) {
                    let why = "replaced".to_owned();
                    return self.event(Event::Undeliverable { session, job, why });
                }
                self.requests.reports.insert(file, job);
                self.requests.written.insert(job);
                FromPeer::ResultDone { job, report }
            }
            Some(Letter::Gone(file)) => {
                self.requests.reports.remove(&file);
                let input = path_of(file).display().to_string();
                FromPeer::WithdrawalDone { input, report }
            }
        };
        if heard {
            self.event(Event::Message { session, message });
        } else {
            self.reporter_dies();
        }
    }

    pub fn reporter_dies(&mut self) {
        if let Some((session, _)) = self.requests.processes.pop_first() {
            self.event(Event::Gone { session });
        }
    }

    /// Whether the reporter is there and has nothing left to do.
    pub fn reporter_rests(&self) -> bool {
        let idle = self.requests.processes.values().any(VecDeque::is_empty);
        !self.requests.open || (idle && self.state.all_delivered())
    }

    /// The broker is killed, and with it whatever was under way.
    pub fn requests_restart(&mut self) {
        self.requests.processes.clear();
        for file in &self.requests.voids {
            self.state.remember_void(&path_of(*file), REPORTER);
        }
    }

    /// What the journal says that the reporter has of a file.
    pub fn delivered(&self, file: u8) -> Vec<(String, Reported)> {
        let job = self.requests.delivered.get(&file);
        job.map(|job| (REPORTER.to_owned(), Reported::Of(*job)))
            .into_iter()
            .collect()
    }
}

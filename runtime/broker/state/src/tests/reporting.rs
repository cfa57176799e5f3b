//! The reporter of a random world: a child that writes the results sent to it, with a delay.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use qcbus_messages::{FromPeer, Hello, JobId, PROTOCOL_VERSION, PeerReport, Role};
use qcbus_types::{ChildSpec, Restart};

use super::super::*;
use super::things::{file_of, path_of};
use super::world::World;

pub const REPORTER: &str = "text";

/// Request to a reporter that has no answer yet.
#[derive(Debug, Clone, Copy)]
enum Letter {
    Result(u8, JobId),
    Gone(u8),
}

/// State of the reporter, its processes and the journal's knowledge of it.
#[derive(Default)]
pub struct ReporterState {
    /// Whether this world has a reporter.
    pub open: bool,
    processes: BTreeMap<SessionId, VecDeque<Letter>>,
    /// Reports written by the reporter: the job of the report on each file.
    pub reports: BTreeMap<u8, JobId>,
    /// All jobs with a report that was ever written.
    written: BTreeSet<JobId>,
    /// Deliveries recorded in the journal: the job of the report on each file.
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
    /// Creates a world with a reporter.
    pub fn with_a_reporter() -> World {
        let mut world = World::new();
        world.reporter_state.open = true;
        world.manifest(None);
        world
    }

    /// Passes an action on to the reporter and the journal.
    pub fn reporter_hears(&mut self, action: &Action) {
        match action {
            Action::Deliver {
                session, delivery, ..
            } => {
                let file = file_of(&delivery.path);
                let about = |it: &Letter| matches!(it, Letter::Result(it, _) if *it == file);
                assert!(
                    !self.reporter_state.processes.values().flatten().any(about),
                    "two results of one file must not be sent at the same time"
                );
                let process = self.reporter_state.processes.get_mut(session);
                let process = process.expect("no result may go to a closed session");
                process.push_back(Letter::Result(file, delivery.job));
            }
            Action::Void { session, path, .. } => {
                let process = self.reporter_state.processes.get_mut(session);
                let process = process.expect("nothing may go to a closed session");
                // A result that is still to be read back is no longer sent.
                let file = file_of(path);
                process.retain(|it| !matches!(it, Letter::Result(it, _) if *it == file));
                process.push_back(Letter::Gone(file));
            }
            Action::Delivered { path, job, .. } => {
                assert!(
                    self.reporter_state.written.contains(job),
                    "only written results are recorded as delivered"
                );
                self.reporter_state.delivered.insert(file_of(path), *job);
            }
            Action::Voided { path, .. } => {
                assert!(!self.reporter_state.reports.contains_key(&file_of(path)));
                self.reporter_state.voids.remove(&file_of(path));
            }
            Action::Withdraw { path, reporters } => {
                self.reporter_state.delivered.remove(&file_of(path));
                if !reporters.is_empty() {
                    self.reporter_state.voids.insert(file_of(path));
                }
            }
            Action::Disconnect { session } | Action::Refuse { session, .. } => {
                self.reporter_state.processes.remove(session);
            }
            _ => {}
        }
    }

    /// Lets the process that was started for the reporter say hello.
    pub fn reporter_joins(&mut self, launch: Launch) {
        self.sessions += 1;
        let session = SessionId(self.sessions);
        self.reporter_state
            .processes
            .insert(session, VecDeque::new());
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

    /// Lets the reporter handle its next request. If `heard` is false, it dies before it answers.
    pub fn report(&mut self, heard: bool) {
        let Some((session, letters)) = self.reporter_state.processes.iter_mut().next() else {
            return;
        };
        let (session, letter) = (*session, letters.pop_front());
        let report = PeerReport::Written;
        let message = match letter {
            None => return,
            Some(Letter::Result(file, job)) => {
                // The result is read back from the disk. Another one may have replaced it by now.
                if self.journal.get(&file).map(|it| it.job) != Some(job) {
                    let why = "replaced".to_owned();
                    return self.event(Event::Undeliverable { session, job, why });
                }
                self.reporter_state.reports.insert(file, job);
                self.reporter_state.written.insert(job);
                FromPeer::ResultDone { job, report }
            }
            Some(Letter::Gone(file)) => {
                self.reporter_state.reports.remove(&file);
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
        if let Some((session, _)) = self.reporter_state.processes.pop_first() {
            self.event(Event::Gone { session });
        }
    }

    /// Checks whether the reporter is there and has nothing left to do.
    pub fn reporter_rests(&self) -> bool {
        let idle = self
            .reporter_state
            .processes
            .values()
            .any(VecDeque::is_empty);
        !self.reporter_state.open || (idle && self.state.all_delivered())
    }

    /// Simulates that the broker is killed, together with all deliveries under way.
    pub fn reporter_restarts(&mut self) {
        self.reporter_state.processes.clear();
        for file in &self.reporter_state.voids {
            self.state.remember_void(&path_of(*file), REPORTER);
        }
    }

    /// Returns the reporter's deliveries of a file according to the journal.
    pub fn delivered(&self, file: u8) -> Vec<(String, Reported)> {
        let job = self.reporter_state.delivered.get(&file);
        job.map(|job| (REPORTER.to_owned(), Reported::Of(*job)))
            .into_iter()
            .collect()
    }
}

//! The bundles of a random world: processes that join, send messages and leave.

use std::collections::BTreeSet;

use qcbus_formats::pool::Ending;
use qcbus_messages::{CheckerEnd, FromPeer, JobId};
use qcbus_types::{ChildEnd, ChildSpec};

use super::super::*;
use super::reporting::{REPORTER, reporter};
use super::things::*;
use super::world::{Launched, Process, World};

impl World {
    pub fn join(&mut self, name: &'static str) {
        let there = |it: &Process| it.name == name && !it.drained;
        if !self.peers.values().any(there) {
            let version = *self.versions.entry(name).or_insert(1);
            self.join_as(name, version, None);
        }
    }

    /// Lets a process that was started for the child say hello.
    pub fn child_joins(&mut self) {
        if !self.launched.is_empty() {
            let it = self.launched.remove(0);
            if it.name == REPORTER {
                self.reporter_joins(it.launch);
            } else {
                self.join_as(it.name, it.version, Some(it.launch.0));
            }
        }
    }

    /// Delivers the earlier messages of a killed process late. `known` means after its end.
    pub fn child_joins_too_late(&mut self, known: bool) {
        let Some(Launched {
            launch,
            name,
            version,
        }) = self.dying.pop()
        else {
            return;
        };
        let end = ChildEnd::Failed("it was killed by signal 9".to_owned());
        if known {
            self.event(Event::Exited {
                launch,
                end: end.clone(),
            });
        }
        let session = self.join_as(name, version, Some(launch.0));
        if self.peers.remove(&session).is_some() {
            self.event(Event::Gone { session });
        }
        if !known {
            self.event(Event::Exited { launch, end });
        }
    }

    /// Lets a process of a former broker join after it has outlived that broker. It reports this version.
    pub fn stale_child_joins(&mut self, version: u8, spec: &ChildSpec) {
        let launch = Launch::first_of(self.generation - 1).next(spec);
        self.join_as(CHILD, version, Some(launch.0));
    }

    fn join_as(&mut self, name: &'static str, version: u8, launch: Option<u64>) -> SessionId {
        self.sessions += 1;
        let session = SessionId(self.sessions);
        self.peers.insert(
            session,
            Process {
                name,
                jobs: BTreeSet::new(),
                begun: BTreeSet::new(),
                drained: false,
            },
        );
        let hello = hello(session, name, version, launch);
        self.event(Event::Hello { session, hello });
        if !self.peers.contains_key(&session) {
            return session;
        }
        let wanted = launch.is_none() || self.manifest.is_some();
        let wanted = wanted && name != SHADOW;
        if wanted {
            self.demanded.insert(name.to_owned(), Some(version));
        }
        self.say(session, FromPeer::Catalogue(Box::new(catalogue(name))));
        session
    }

    pub fn say(&mut self, session: SessionId, message: FromPeer) {
        if self.peers.contains_key(&session) {
            self.event(Event::Message { session, message });
        }
    }

    pub fn nth_peer(&self, n: u8) -> Option<SessionId> {
        let count = self.peers.len();
        (count > 0).then(|| *self.peers.keys().nth(usize::from(n) % count).unwrap())
    }

    pub fn kill(&mut self, n: u8) {
        if let Some(session) = self.nth_peer(n) {
            self.peers.remove(&session);
            self.event(Event::Gone { session });
        }
    }

    /// Lets a bundle leave on its own or because it was told to.
    pub fn leave(&mut self, n: u8) {
        let Some(session) = self.nth_peer(n) else {
            return;
        };
        let Process { name, drained, .. } = self.peers[&session];
        // A bundle that another one has replaced does not change the required set.
        let current = self.state.sessions.contains_key(&session);
        // A bundle that was told to leave because the broker ends is still required at the next start.
        let current = current && !matches!(self.state.phase, Phase::Leaving(_));
        if current && !(name == CHILD && self.manifest.is_some() && !drained) {
            self.demanded.remove(name);
        }
        self.say(session, FromPeer::Leaving);
    }

    /// Adds, changes or removes the manifest of the child.
    pub fn manifest(&mut self, version: Option<u8>) {
        if version.is_some() {
            // Its last process may still be running, so that process's version counts.
            let known = self.state.bundles.get(CHILD);
            let known = known.filter(|it| it.catalogue.is_some());
            let known = known.and_then(|it| it.version.parse().ok());
            self.demanded.entry(CHILD.to_owned()).or_insert(known);
        } else {
            self.demanded.remove(CHILD);
        }
        self.manifest = version;
        self.children_are(version);
    }

    pub fn children_are(&mut self, version: Option<u8>) {
        let reporter = self.reporter_state.open.then(reporter);
        let children = version.map(child).into_iter();
        let children = children.chain(self.shadow.map(shadow));
        let specs = children.chain(reporter).collect();
        self.event(Event::Children { specs });
    }

    /// Removes a bundle from the registry.
    pub fn remove(&mut self, name: &'static str) {
        if name != CHILD || self.manifest.is_none() {
            self.demanded.remove(name);
        }
        self.request_ids += 1;
        let request_id = RequestId(self.request_ids);
        self.waiting.insert(request_id, 0);
        let name = name.to_owned();
        self.event(Event::RemoveBundle { request_id, name });
    }

    /// Ends a process of the child that has not joined.
    pub fn child_ends(&mut self, end: ChildEnd) {
        if !self.launched.is_empty() {
            let Launched { launch, .. } = self.launched.remove(0);
            self.event(Event::Exited { launch, end });
        }
    }

    /// Lets a bundle report on a job without ending it.
    pub fn begin(&mut self, n: u8) {
        let Some(session) = self.nth_peer(n) else {
            return;
        };
        let process = self.peers.get_mut(&session).unwrap();
        let new = process.jobs.difference(&process.begun).next().copied();
        if let Some(job) = new {
            process.begun.insert(job);
            self.says_on(session, job, 0, 2);
        }
    }

    fn says_on(&mut self, session: SessionId, job: JobId, checker: u32, findings: usize) {
        let issues = vec![finding(); findings];
        self.say(
            session,
            FromPeer::Issues {
                job,
                checker,
                issues,
            },
        );
        self.say(
            session,
            FromPeer::CheckersDone {
                job,
                ended: vec![CheckerEnd {
                    checker,
                    ending: Ending::Completed,
                    params: Vec::new(),
                    metadata: Vec::new(),
                }],
            },
        );
    }

    /// Lets a bundle end its job with this number of findings for each checker.
    pub fn answers_with(&mut self, n: u8, findings: usize) {
        let session = self.nth_peer(n).unwrap();
        let process = self.peers.get_mut(&session).unwrap();
        let job = process.jobs.pop_first().unwrap();
        for checker in 0..2 {
            self.says_on(session, job, checker, findings);
        }
        self.say(session, FromPeer::JobDone { job, micros: 1 });
    }

    pub fn answer(&mut self, n: u8) {
        let Some(session) = self.nth_peer(n) else {
            return;
        };
        let bundle = &self.peers[&session];
        if bundle.drained && bundle.jobs.is_empty() {
            return self.leave(n);
        }
        let Some(job) = self
            .peers
            .get_mut(&session)
            .and_then(|it| it.jobs.pop_first())
        else {
            return;
        };
        let process = self.peers.get_mut(&session).unwrap();
        for checker in u32::from(process.begun.remove(&job))..2 {
            // Some bundles report more, so that the room for findings is exhausted now and then.
            self.says_on(session, job, checker, usize::from(n % 3));
        }
        self.say(session, FromPeer::JobDone { job, micros: 1 });
    }
}

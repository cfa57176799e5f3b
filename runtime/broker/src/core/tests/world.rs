//! A world around the state machine: it answers actions when it pleases, and knows what must be so.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::super::*;
use super::behind_the_gate::Published;
use super::reporting::{Desk, REPORTER, reporter};
use crate::InForce;
use qcbus_document::FileKind;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::control::Response;
use qcbus_messages::{
    Catalogue, CheckerInfo, Digest, DocId, DocumentRole, FromPeer, Hello, JobDocument, JobId,
    PROTOCOL_VERSION, Role, ToPeer, Verdict,
};

pub const CAPACITY: usize = 2;

/// The bundle that a manifest brings; the others join by hand.
pub const CHILD: &str = "Child";

fn child(version: u8) -> ChildSpec {
    ChildSpec {
        name: CHILD.to_owned(),
        role: Role::Bundle,
        version: Some(version.to_string()),
        command: vec!["child".to_owned()],
        restart: Restart::Always,
    }
}

fn fresh_state(generation: u64, configuration: u8) -> State {
    let in_force = InForce::new(None).unwrap();
    let settings = Settings {
        generation,
        collect: Duration::ZERO,
        max_active: 4,
        max_preparing: 2,
        max_storing: 2,
        max_findings_bytes: 1000,
        ..Settings::default()
    };
    State::new(settings, digest(configuration.into()), in_force.demand())
}

/// A jury as it can be compared.
pub fn named(jury: &Jury) -> Vec<(String, Option<Mark>)> {
    let juror = |it: &Juror| (it.name.clone(), it.mark);
    jury.0.iter().map(juror).collect()
}

/// A world around the state machine: it answers actions when it pleases.
pub struct World {
    pub state: State,
    pub now: Duration,
    /// What is there, each with the number of its stamp.
    pub there: HashMap<Arc<Path>, u64>,
    /// The bytes behind each stamp: a file that is touched has the same under a new one.
    pub contents: HashMap<u64, u64>,
    pub stamps: u64,
    pub preparing: Vec<(JobId, u8)>,
    pub storing: Vec<FinishedJob>,
    pub stored: Vec<u8>,
    pub peers: BTreeMap<SessionId, Process>,
    pub sessions: u64,
    pub judged: BTreeMap<u8, (Vec<Input>, Verdict)>,
    /// The bundles whose judgement is in the verdict of each file, as stored.
    pub judges: BTreeMap<u8, Vec<String>>,
    pub released: BTreeSet<JobId>,
    /// Who must judge, and as which version: what the state machine has to keep to.
    pub demanded: BTreeMap<String, Option<u8>>,
    /// The version of each bundle's next process.
    pub versions: BTreeMap<&'static str, u8>,
    /// Children that were started and have not joined.
    pub launched: Vec<(Launch, &'static str)>,
    pub killed: Vec<Launch>,
    /// Whether the manifest of the child is there.
    pub manifest: bool,
    /// What the journal has been told.
    pub members: BTreeMap<String, Member>,
    pub journal: BTreeMap<u8, Judged>,
    pub generation: u64,
    pub reconfigured: u8,
    pub tickets: u64,
    pub waiting: BTreeMap<Ticket, u8>,
    /// Until when those wait who do not wait for ever.
    pub until: BTreeMap<Ticket, Duration>,
    /// What writers have done and the state machine has not heard.
    pub told: Vec<((u8, JobId), StoreOutcome)>,
    pub gate: Published,
    pub desk: Desk,
    /// Why bundles have failed on each file, as stored.
    pub failures: BTreeMap<u8, Vec<String>>,
    /// How often the state machine has ended.
    pub stopped: u8,
}

/// A process of a bundle.
pub struct Process {
    pub name: &'static str,
    pub jobs: BTreeSet<JobId>,
    /// Those of them of which it has said something.
    pub begun: BTreeSet<JobId>,
    /// It was told to finish and go.
    pub drained: bool,
}

/// The first six are checked, the others are only dependencies of them.
pub fn path_of(file: u8) -> Arc<Path> {
    let ending = if file < 6 { "xodr" } else { "part" };
    Path::new(&format!("/farm/{file}.{ending}")).into()
}

/// What a verdict depends on besides the file: on another that has a verdict itself, on a part of
/// its own, on a part that it shares, on all of these, or on nothing.
pub fn dependencies_of(file: u8) -> &'static [u8] {
    match file {
        1 => &[0, 6],
        2 => &[6],
        3 => &[4],
        5 => &[4, 6, 7],
        _ => &[],
    }
}

pub fn file_of(path: &Path) -> u8 {
    path.file_stem()
        .and_then(|it| it.to_str())
        .and_then(|it| it.parse().ok())
        .unwrap()
}

pub fn stamp(number: u64) -> Stamp {
    Stamp {
        size: number,
        mtime_ns: i128::from(number),
        ctime_ns: i128::from(number),
        inode: 1,
    }
}

pub fn digest(number: u64) -> Digest {
    let mut digest = Digest::default();
    digest.0[..8].copy_from_slice(&number.to_le_bytes());
    digest
}

pub fn basis(inputs: &[Input]) -> Digest {
    let mut basis = Digest::default();
    for (at, input) in inputs.iter().enumerate() {
        if let Some((_, digest)) = input.content {
            basis.0[at * 8..][..8].copy_from_slice(&digest.0[..8]);
        }
    }
    basis
}

pub fn catalogue(name: &str) -> Catalogue {
    let checker = |id: String| CheckerInfo {
        id,
        description: String::new(),
        rule_uids: Vec::new(),
        kinds: vec![FileKind::Xodr],
        default_on: true,
        level: Level::Error,
        params: Vec::new(),
    };
    Catalogue {
        alias: name.to_lowercase(),
        kinds: vec![FileKind::Xodr],
        checkers: vec![
            checker(format!("{name}.one")),
            checker(format!("{name}.two")),
        ],
        ..Catalogue::default()
    }
}

pub fn finding() -> Issue {
    Issue {
        id: 0,
        description: "too much".to_owned(),
        level: Level::Warning,
        rule_uid: String::new(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    }
}

impl World {
    pub fn new() -> World {
        let mut world = World {
            state: fresh_state(1, 0),
            now: Duration::ZERO,
            there: HashMap::new(),
            contents: HashMap::new(),
            stamps: 0,
            preparing: Vec::new(),
            storing: Vec::new(),
            stored: Vec::new(),
            peers: BTreeMap::new(),
            sessions: 0,
            judged: BTreeMap::new(),
            judges: BTreeMap::new(),
            released: BTreeSet::new(),
            demanded: BTreeMap::new(),
            versions: BTreeMap::new(),
            launched: Vec::new(),
            killed: Vec::new(),
            manifest: false,
            members: BTreeMap::new(),
            journal: BTreeMap::new(),
            generation: 1,
            reconfigured: 0,
            tickets: 0,
            waiting: BTreeMap::new(),
            until: BTreeMap::new(),
            told: Vec::new(),
            gate: Published::new(),
            desk: Desk::default(),
            failures: BTreeMap::new(),
            stopped: 0,
        };
        world.event(Event::Scanned);
        world
    }

    pub fn event(&mut self, event: Event) {
        for action in self.state.handle(self.now, event) {
            self.desk_hears(&action);
            self.gate_follows(&action);
            self.act(action);
        }
        self.gate_must_be_true();
    }

    pub fn act(&mut self, action: Action) {
        match action {
            Action::Prepare { job, path } => self.preparing.push((job, file_of(&path))),
            Action::Release { job } => {
                self.released.insert(job);
            }
            Action::Send {
                session,
                message: ToPeer::Job(job),
            } => {
                let bundle = self
                    .peers
                    .get_mut(&session)
                    .expect("no job goes to a closed session");
                assert!(
                    bundle.jobs.insert(job.job),
                    "a job is given out once per session"
                );
                assert!(bundle.jobs.len() <= CAPACITY, "the credit window is kept");
            }
            Action::Send {
                session,
                message: ToPeer::Cancel { job },
            } => {
                if let Some(bundle) = self.peers.get_mut(&session) {
                    bundle.jobs.remove(&job);
                }
            }
            Action::Send {
                session,
                message: ToPeer::Drain,
            } => {
                if let Some(bundle) = self.peers.get_mut(&session) {
                    bundle.drained = true;
                }
            }
            Action::Disconnect { session } | Action::Refuse { session, .. } => {
                self.peers.remove(&session);
            }
            Action::Spawn { launch, spec } => {
                let bundle = spec.role == Role::Bundle;
                self.launched
                    .push((launch, if bundle { CHILD } else { REPORTER }));
            }
            Action::Kill { launch, .. } => {
                self.killed.extend(launch);
                self.launched.retain(|(it, _)| Some(*it) != launch);
            }
            Action::Enrol(member) => {
                self.members.insert(member.name.clone(), member);
            }
            Action::Strike { name } => {
                self.members.remove(&name);
            }
            Action::Restamp { path, judged } => {
                self.journal.insert(file_of(&path), (*judged).clone());
            }
            Action::Store(job) => {
                let names: BTreeSet<_> =
                    job.bundles.iter().map(|it| it.said.name.clone()).collect();
                assert_eq!(
                    names.len(),
                    job.bundles.len(),
                    "no bundle is in a result twice"
                );
                for bundle in job.bundles.iter().filter(|it| it.catalogue.is_some()) {
                    assert_eq!(
                        bundle.said.checkers.len(),
                        2,
                        "every demanded checker is there"
                    );
                    let mut checkers = bundle.said.checkers.iter();
                    assert!(
                        checkers.all(|it| it.issues.len() <= 2),
                        "what a session said that has ended counts for nothing"
                    );
                }
                self.storing.push(*job);
            }
            Action::Judged {
                path,
                judged,
                fresh,
            } => {
                // One that others must judge by now may be heard of late, where it is on its way.
                if !fresh || judged.epoch == self.state.epoch() {
                    self.must_be_earned(&judged);
                }
                let known = self.journal.get(&file_of(&path)).map(|it| it.job);
                assert_eq!(
                    known,
                    Some(judged.job),
                    "nothing is told before it is stored"
                );
                let verdict = (judged.inputs.clone(), judged.verdict);
                self.judged.insert(file_of(&path), verdict);
            }
            Action::Answer { ticket, response } => {
                let file = self.waiting.remove(&ticket).expect("one answer for each");
                let until = self.until.remove(&ticket);
                if response == Response::TimedOut {
                    assert!(until.is_some_and(|until| until <= self.now), "not too soon");
                }
                if matches!(response, Response::Verdict(_)) {
                    let judged = self.verdict_on(file);
                    self.must_be_earned(&judged);
                    let told = self.state.inputs_of(&path_of(file));
                    assert_eq!(told, self.inputs(file), "the answer is true at that moment");
                }
            }
            Action::Withdraw { path, .. } => {
                self.journal.remove(&file_of(&path));
                self.judged.remove(&file_of(&path));
            }
            Action::Stop => self.stopped += 1,
            _ => {}
        }
    }

    fn verdict_on(&self, file: u8) -> Arc<Judged> {
        let id = self.state.files.id(&path_of(file)).unwrap();
        let entry = self.state.files.get(id).unwrap();
        entry.judged.clone().unwrap()
    }

    /// Nothing is accepted, and nobody is told so, unless all judged who must at this moment.
    fn must_be_earned(&self, judged: &Judged) {
        if judged.verdict == Verdict::Accepted {
            assert_eq!(named(&judged.jury), self.expected_jury());
        }
        let config = digest(self.reconfigured.into());
        assert_eq!(judged.config, config, "of the configuration in force");
    }

    /// Who must judge, each as what it is.
    pub fn expected_jury(&self) -> Vec<(String, Option<Mark>)> {
        let mark = |(name, version): (&String, &Option<u8>)| {
            let mark = version.map(|it| Mark::of(&it.to_string(), &catalogue(name)));
            (name.clone(), mark)
        };
        self.demanded.iter().map(mark).collect()
    }

    pub fn write(&mut self, file: u8) {
        self.put(file, self.stamps + 1);
    }

    /// The same bytes under a new stamp.
    pub fn touch(&mut self, file: u8) {
        if let Some(number) = self.there.get(&path_of(file)) {
            self.put(file, self.contents[number]);
        }
    }

    pub fn put(&mut self, file: u8, content: u64) {
        self.stamps += 1;
        self.contents.insert(self.stamps, content);
        self.there.insert(path_of(file), self.stamps);
        let (path, stamp) = (path_of(file), stamp(self.stamps));
        // As the engine does with what lies outside of the watched directories.
        self.event(if file == 7 && self.state.is_only_a_dependency(&path) {
            Event::Touched { path, stamp }
        } else {
            Event::Settled { path, stamp }
        });
    }

    pub fn delete(&mut self, file: u8) {
        if self.there.remove(&path_of(file)).is_some() {
            self.event(Event::Vanished {
                path: path_of(file),
            });
        }
    }

    fn is_there(&self, name: &str) -> bool {
        let mut peers = self.peers.values();
        peers.any(|it| it.name == name && !it.drained)
    }

    pub fn wait(&mut self, file: u8) {
        self.wait_until(file, None);
    }

    pub fn wait_until(&mut self, file: u8, timeout: Option<Duration>) {
        self.tickets += 1;
        self.waiting.insert(Ticket(self.tickets), file);
        if let Some(timeout) = timeout {
            self.until.insert(Ticket(self.tickets), self.now + timeout);
        }
        let path = path_of(file);
        self.event(Event::Wait {
            ticket: Ticket(self.tickets),
            stamp: self.there.get(&path).map(|number| stamp(*number)),
            path,
            unwatched: None,
            timeout,
        });
    }

    pub fn names_that_judged(&self, file: u8) -> Vec<&str> {
        self.judges[&file].iter().map(String::as_str).collect()
    }

    pub fn input(&self, file: u8) -> Input {
        let path = path_of(file);
        let number = self.there.get(&path);
        Input {
            content: number.map(|it| (stamp(*it), digest(self.contents[it]))),
            path,
        }
    }

    /// What reading a file now would give.
    pub fn inputs(&self, file: u8) -> Vec<Input> {
        let others = dependencies_of(file).iter();
        let all = std::iter::once(&file).chain(others);
        all.map(|it| self.input(*it)).collect()
    }

    pub fn join(&mut self, name: &'static str) {
        let there = |it: &Process| it.name == name && !it.drained;
        if !self.peers.values().any(there) {
            self.join_as(name, None);
        }
    }

    /// A process that was started for the child says hello.
    pub fn child_joins(&mut self) {
        if !self.launched.is_empty() {
            let (launch, name) = self.launched.remove(0);
            if name == REPORTER {
                self.reporter_joins(launch);
            } else {
                self.join_as(name, Some(launch.0));
            }
        }
    }

    fn join_as(&mut self, name: &'static str, launch: Option<u64>) {
        let version = *self.versions.entry(name).or_insert(1);
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
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            role: Role::Bundle,
            name: name.to_owned(),
            version: version.to_string(),
            incarnation: self.sessions,
            pid: u32::try_from(self.sessions).unwrap() + 1000,
            launch,
            capacity: u16::try_from(CAPACITY).unwrap(),
        };
        self.event(Event::Hello { session, hello });
        if !self.peers.contains_key(&session) {
            return;
        }
        let wanted = launch.is_none() || self.manifest;
        if wanted {
            self.demanded.insert(name.to_owned(), Some(version));
        }
        self.say(session, FromPeer::Catalogue(Box::new(catalogue(name))));
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

    /// A bundle goes of its own will, or because it was told to.
    pub fn leave(&mut self, n: u8) {
        let Some(session) = self.nth_peer(n) else {
            return;
        };
        let Process { name, drained, .. } = self.peers[&session];
        // One that somebody else has replaced leaves nothing.
        let current = self.state.sessions.contains_key(&session);
        if current && !(name == CHILD && self.manifest && !drained) {
            self.demanded.remove(name);
        }
        self.say(session, FromPeer::Leaving);
    }

    /// The manifest of the child comes, changes or goes.
    pub fn manifest(&mut self, version: Option<u8>) {
        if let Some(version) = version {
            self.versions.insert(CHILD, version);
            // Its last process may not have left yet: what that one said counts.
            let known = self.state.bundles.get(CHILD);
            let known = known.filter(|it| it.catalogue.is_some());
            let known = known.and_then(|it| it.version.parse().ok());
            self.demanded.entry(CHILD.to_owned()).or_insert(known);
        } else {
            self.demanded.remove(CHILD);
        }
        self.manifest = version.is_some();
        self.children_are(version);
    }

    fn children_are(&mut self, version: Option<u8>) {
        let reporter = self.desk.open.then(reporter);
        let specs = version.map(child).into_iter().chain(reporter).collect();
        self.event(Event::Children { specs });
    }

    /// Somebody takes a bundle off the roster.
    pub fn remove(&mut self, name: &'static str) {
        if name != CHILD || !self.manifest {
            self.demanded.remove(name);
        }
        self.tickets += 1;
        let ticket = Ticket(self.tickets);
        self.waiting.insert(ticket, 0);
        let name = name.to_owned();
        self.event(Event::RemoveBundle { ticket, name });
    }

    /// What a child's process that has not joined comes to.
    pub fn child_ends(&mut self, end: ChildEnd) {
        if !self.launched.is_empty() {
            let (launch, _) = self.launched.remove(0);
            self.event(Event::Exited { launch, end });
        }
    }

    /// The broker is killed, something happens to a file, and the next one knows what the journal
    /// knows. `unsettled`: what is there may still be written to when it is first seen.
    pub fn restart_after(&mut self, file: u8, unsettled: bool) {
        self.stamps += 1;
        if self.there.remove(&path_of(file)).is_none() {
            self.contents.insert(self.stamps, self.stamps);
            self.there.insert(path_of(file), self.stamps);
        }
        self.restart_with(unsettled);
    }

    /// The broker is killed, and the next one knows what the journal knows.
    pub fn restart(&mut self) {
        self.restart_with(false);
    }

    fn restart_with(&mut self, unsettled: bool) {
        self.generation += 1;
        self.state = fresh_state(self.generation, self.reconfigured);
        self.preparing.clear();
        self.storing.clear();
        self.peers.clear();
        self.launched.clear();
        self.waiting.clear();
        self.until.clear();
        self.told.clear();
        self.judged.clear();
        self.gate_is_taken_over();
        for member in self.members.values() {
            self.state.remember_member(member.clone());
        }
        for (file, judged) in self.journal.clone() {
            let mut judged = judged;
            // As the engine does: what has changed while nobody watched is looked at again.
            judged.racy |= judged.inputs[1..] != self.inputs(file)[1..];
            let delivered = self.delivered(file);
            self.state.remember(&path_of(file), judged, &delivered);
        }
        self.desk_restarts();
        let version = self.versions.get(CHILD).copied().filter(|_| self.manifest);
        self.children_are(version);
        let there: Vec<(Arc<Path>, u64)> = self.there.clone().into_iter().collect();
        if unsettled {
            for (path, _) in there.clone() {
                self.event(Event::Present { path });
            }
            self.event(Event::Scanned);
        }
        for (path, number) in there {
            let stamp = stamp(number);
            self.event(Event::Settled { path, stamp });
        }
        if !unsettled {
            self.event(Event::Scanned);
        }
    }

    /// A bundle says something of a job, and does not end it.
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
            FromPeer::CheckerDone {
                job,
                checker,
                ending: Ending::Completed,
                params: Vec::new(),
                metadata: Vec::new(),
            },
        );
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
            // Some have much to say, so that the room for findings runs out now and then.
            self.says_on(session, job, checker, usize::from(n % 3));
        }
        self.say(session, FromPeer::JobDone { job, micros: 1 });
    }

    pub fn prepare(&mut self, n: u8, room: bool) {
        if self.preparing.is_empty() {
            return;
        }
        let (job, file) = self.preparing.remove(usize::from(n) % self.preparing.len());
        let inputs = self.inputs(file);
        let result = match inputs[0].content {
            None => Err(PrepareFailure::Vanished),
            Some(_) if !room => Err(PrepareFailure::NoRoom("full".to_owned())),
            Some((_, digest)) => {
                let document = JobDocument {
                    doc: DocId(job.0),
                    role: DocumentRole::Root,
                    path: String::new(),
                    digest,
                    referred_at: 0,
                };
                Ok(Box::new(PreparedJob {
                    basis: basis(&inputs),
                    inputs,
                    racy: false,
                    documents: vec![document],
                    missing: Vec::new(),
                    bytes: 1,
                }))
            }
        };
        self.event(Event::Prepared { job, result });
    }

    pub fn store(&mut self, n: u8, room: bool) {
        self.write_out(n, room);
        while !self.told.is_empty() {
            self.tell();
        }
    }

    /// The state machine hears what a writer has done.
    pub fn tell(&mut self) {
        if !self.told.is_empty() {
            let ((_, job), outcome) = self.told.remove(0);
            self.event(Event::Stored { job, outcome });
        }
    }

    /// A writer does its work, and nobody hears of it yet.
    pub fn write_out(&mut self, n: u8, room: bool) {
        if self.storing.is_empty() {
            return;
        }
        let job = self.storing.remove(usize::from(n) % self.storing.len());
        let file = file_of(&job.path);
        let prepared = job.prepared.as_ref().unwrap();
        let outcome = if prepared.inputs != self.inputs(file) {
            StoreOutcome::Stale
        } else if job.epoch != self.state.epoch() {
            StoreOutcome::Outdated
        } else if !room {
            StoreOutcome::Failed("full".to_owned())
        } else {
            self.stored.push(file);
            let names = job.bundles.iter().map(|it| it.said.name.clone());
            self.judges.insert(file, names.collect());
            let why = job.bundles.iter().filter_map(|it| it.failure.clone());
            let why: Vec<String> = why.collect();
            let failed = !why.is_empty();
            self.failures.insert(file, why);
            let judged = Judged {
                job: job.job,
                verdict: if failed {
                    Verdict::Undetermined
                } else {
                    Verdict::Accepted
                },
                digest: prepared.root().unwrap().1,
                basis: prepared.basis,
                config: job.config,
                jury: job.jury.clone(),
                epoch: job.epoch,
                inputs: prepared.inputs.clone(),
                racy: false,
                counts: [0; 3],
                why: Vec::new(),
                xqar: "/out".into(),
            };
            self.must_be_earned(&judged);
            self.journal.insert(file, judged.clone());
            self.publish(file, &judged);
            StoreOutcome::Stored(Box::new(judged))
        };
        self.told.push(((file, job.job), outcome));
    }

    pub fn pass(&mut self, time: Duration) {
        self.now += time;
        self.event(Event::Tick);
        let late = self.until.values().any(|until| *until <= self.now);
        assert!(
            !late,
            "whoever does not wait for ever is told when it is over"
        );
    }

    /// Everybody is there and does something.
    fn go_on(&mut self) {
        self.join("First");
        self.join("Second");
        self.child_joins();
        for n in 0..4 {
            self.prepare(n, true);
            self.answer(n);
            self.store(n, true);
            self.report(true);
        }
        self.pass(Duration::from_millis(300));
    }

    /// The broker is told to stop.
    pub fn drain(&mut self) {
        self.event(Event::Drain);
        for _ in 0..2000 {
            if self.stopped > 0 {
                return;
            }
            self.go_on();
        }
        panic!("it does not stop: {:#?}", self.state.jobs);
    }

    /// Lets everything that is under way come to its end, with both bundles there.
    pub fn settle(&mut self) {
        for _ in 0..2000 {
            self.go_on();
            let all = self.demanded.values().all(Option::is_some) && self.launched.is_empty();
            let all = all && self.demanded.keys().all(|name| self.is_there(name));
            let all = all && self.state.files.is_quiet() && self.state.jobs.is_empty();
            if all && self.reporter_rests() {
                return;
            }
        }
        panic!(
            "the state machine does not come to rest: {:#?}",
            self.state.jobs
        );
    }
}

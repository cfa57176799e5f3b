//! A world around the state machine: it answers actions when it pleases, and knows what must be so.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::super::*;
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
}

/// A process of a bundle.
pub struct Process {
    pub name: &'static str,
    pub jobs: BTreeSet<JobId>,
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
        if let Some(digest) = input.digest() {
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
        };
        world.event(Event::Scanned);
        world
    }

    pub fn event(&mut self, event: Event) {
        for action in self.state.handle(self.now, event) {
            self.act(action);
        }
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
            Action::Spawn { launch, .. } => self.launched.push((launch, CHILD)),
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
                }
                self.storing.push(*job);
            }
            Action::Judged { path, judged, .. } => {
                self.must_be_earned(&judged);
                let verdict = (judged.inputs.clone(), judged.verdict);
                self.judged.insert(file_of(&path), verdict);
            }
            Action::Answer { ticket, response } => {
                let file = self.waiting.remove(&ticket).expect("one answer for each");
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
        let stamp = stamp(self.stamps);
        self.event(Event::Settled {
            path: path_of(file),
            stamp,
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
        self.tickets += 1;
        self.waiting.insert(Ticket(self.tickets), file);
        let path = path_of(file);
        self.event(Event::Wait {
            ticket: Ticket(self.tickets),
            stamp: self.there.get(&path).map(|number| stamp(*number)),
            path,
            unwatched: None,
            timeout: None,
        });
    }

    pub fn names_that_judged(&self, file: u8) -> Vec<&str> {
        self.judges[&file].iter().map(String::as_str).collect()
    }

    pub fn input(&self, file: u8) -> Input {
        let path = path_of(file);
        let number = self.there.get(&path);
        Input {
            content: number.map_or(Reading::Absent, |it| {
                Reading::Read(stamp(*it), digest(self.contents[it]))
            }),
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
            self.join_as(name, Some(launch.0));
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
        self.event(Event::Children {
            specs: version.map(child).into_iter().collect(),
        });
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

    /// The broker is killed, and the next one knows what the journal knows.
    pub fn restart(&mut self) {
        self.generation += 1;
        self.state = fresh_state(self.generation, self.reconfigured);
        self.preparing.clear();
        self.storing.clear();
        self.peers.clear();
        self.launched.clear();
        self.waiting.clear();
        self.judged.clear();
        for member in self.members.values() {
            self.state.remember_member(member.clone());
        }
        for (file, judged) in self.journal.clone() {
            let mut judged = judged;
            // As the engine does: what has changed while nobody watched is looked at again.
            judged.racy |= judged.inputs[1..] != self.inputs(file)[1..];
            self.state.remember(&path_of(file), judged, &[]);
        }
        let version = self.versions.get(CHILD).copied().filter(|_| self.manifest);
        let specs = version.map(child).into_iter().collect();
        self.event(Event::Children { specs });
        let there: Vec<(Arc<Path>, u64)> = self.there.clone().into_iter().collect();
        for (path, number) in there {
            let stamp = stamp(number);
            self.event(Event::Settled { path, stamp });
        }
        self.event(Event::Scanned);
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
        for checker in 0..2 {
            // Some have much to say, so that the room for findings runs out now and then.
            let issues = vec![finding(); usize::from(n % 3)];
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
        self.say(session, FromPeer::JobDone { job, micros: 1 });
    }

    pub fn prepare(&mut self, n: u8, room: bool) {
        if self.preparing.is_empty() {
            return;
        }
        let (job, file) = self.preparing.remove(usize::from(n) % self.preparing.len());
        let inputs = self.inputs(file);
        let result = match inputs[0].digest() {
            None => Err(PrepareFailure::Vanished),
            Some(_) if !room => Err(PrepareFailure::NoRoom("full".to_owned())),
            Some(digest) => {
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
            let failed = job.bundles.iter().any(|bundle| bundle.failure.is_some());
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
                xqar: Some("/out".into()),
            };
            self.journal.insert(file, judged.clone());
            StoreOutcome::Stored(Box::new(judged))
        };
        self.event(Event::Stored {
            job: job.job,
            outcome,
        });
    }

    pub fn pass(&mut self, time: Duration) {
        self.now += time;
        self.event(Event::Tick);
    }

    /// Lets everything that is under way come to its end, with both bundles there.
    pub fn settle(&mut self) {
        for _ in 0..2000 {
            self.join("First");
            self.join("Second");
            self.child_joins();
            for n in 0..4 {
                self.prepare(n, true);
                self.answer(n);
                self.store(n, true);
            }
            self.pass(Duration::from_millis(300));
            let all = self.demanded.values().all(Option::is_some) && self.launched.is_empty();
            let all = all && self.demanded.keys().all(|name| self.is_there(name));
            if all && self.state.files.is_quiet() && self.state.jobs.is_empty() {
                return;
            }
        }
        panic!(
            "the state machine does not come to rest: {:#?}",
            self.state.jobs
        );
    }
}

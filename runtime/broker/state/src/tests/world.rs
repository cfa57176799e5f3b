//! A world around the state machine: it answers actions at any time and checks the invariants.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::{JobId, Verdict};
use qcbus_types::{FinishedJob, Member, Reading, StoreOutcome, Until, VersionDigest};

use super::super::*;
use super::behind_the_gate::Published;
use super::clients::Clients;
use super::reporting::ReporterState;
use super::things::*;

/// World around the state machine that answers actions at any time.
pub struct World {
    pub state: State,
    pub now: Duration,
    /// Existing files with the number of their stamp.
    pub there: HashMap<Arc<Path>, u64>,
    /// Content behind each stamp. A touched file has the same content under a new stamp.
    pub contents: HashMap<u64, u64>,
    pub stamps: u64,
    pub preparing: Vec<(JobId, u8)>,
    /// Waiting time of each job's file before it was read.
    pub waited: BTreeMap<JobId, Duration>,
    pub storing: Vec<FinishedJob>,
    pub stored: Vec<u8>,
    /// Files with a result that was removed by others and is not written again yet.
    pub lost: BTreeSet<u8>,
    pub peers: BTreeMap<SessionId, Process>,
    pub sessions: u64,
    pub judged: BTreeMap<u8, (Vec<Input>, Verdict)>,
    /// Bundles with a judgement in the stored verdict of each file.
    pub judges: BTreeMap<u8, Vec<String>>,
    pub released: BTreeSet<JobId>,
    /// Required bundles with their versions. The state machine must comply with them.
    pub demanded: BTreeMap<String, Option<u8>>,
    /// Version of each bundle's next process.
    pub versions: BTreeMap<&'static str, u8>,
    /// Children that were started and have not joined yet.
    pub launched: Vec<Launched>,
    /// Children of `launched` that were killed. Their earlier messages may still arrive.
    pub dying: Vec<Launched>,
    pub killed: Vec<Launch>,
    /// Version in the manifest of the child, if the manifest exists.
    pub manifest: Option<u8>,
    /// Version in the manifest of the shadow, if the manifest exists.
    pub shadow: Option<u8>,
    /// Required bundles recorded in the journal.
    pub members: BTreeMap<String, Member>,
    pub journal: BTreeMap<u8, Judged>,
    pub generation: u64,
    pub reconfigured: u8,
    pub request_ids: u64,
    pub waiting: BTreeMap<RequestId, u8>,
    /// Deadlines of the requests that have a timeout.
    pub until: BTreeMap<RequestId, Duration>,
    /// Outcomes of writers that the state machine has not received yet.
    pub told: Vec<((u8, JobId), StoreOutcome)>,
    /// Files watched because verdicts depend on them.
    pub watched: BTreeSet<u8>,
    pub gate: Published,
    pub reporter_state: ReporterState,
    pub clients: Clients,
    /// Reasons why bundles failed on each file, as stored.
    pub failures: BTreeMap<u8, Vec<String>>,
    /// Files with an error in them.
    pub rejected: BTreeSet<u8>,
    /// Rejected maps named in the result of each file, as stored.
    pub said_of_maps: BTreeMap<u8, Vec<u8>>,
    /// Whether files are too young for their stamps to prove anything.
    pub young: bool,
    /// Number of times that the state machine has ended.
    pub stopped: u8,
}

/// A process that was started and has not joined yet.
#[derive(Clone)]
pub struct Launched {
    pub launch: Launch,
    pub name: &'static str,
    /// Version in the manifest that started the process.
    pub version: u8,
}

/// A process of a bundle.
pub struct Process {
    pub name: &'static str,
    pub jobs: BTreeSet<JobId>,
    /// Jobs of `jobs` on which the process has reported something.
    pub begun: BTreeSet<JobId>,
    /// Whether the process was told to finish and leave.
    pub drained: bool,
}

impl World {
    /// Creates a world in which a bundle has a job.
    pub fn at_work() -> World {
        let mut world = World::new();
        world.join("First");
        world.write(0);
        world.prepare(0, true);
        world
    }

    pub fn new() -> World {
        let mut world = World {
            state: fresh_state(1, 0),
            now: Duration::ZERO,
            there: HashMap::new(),
            contents: HashMap::new(),
            stamps: 0,
            preparing: Vec::new(),
            waited: BTreeMap::new(),
            storing: Vec::new(),
            stored: Vec::new(),
            lost: BTreeSet::new(),
            peers: BTreeMap::new(),
            sessions: 0,
            judged: BTreeMap::new(),
            judges: BTreeMap::new(),
            released: BTreeSet::new(),
            demanded: BTreeMap::new(),
            versions: BTreeMap::new(),
            launched: Vec::new(),
            dying: Vec::new(),
            killed: Vec::new(),
            manifest: None,
            shadow: None,
            members: BTreeMap::new(),
            journal: BTreeMap::new(),
            generation: 1,
            reconfigured: 0,
            request_ids: 0,
            waiting: BTreeMap::new(),
            until: BTreeMap::new(),
            told: Vec::new(),
            watched: BTreeSet::new(),
            gate: Published::new(),
            reporter_state: ReporterState::default(),
            clients: Clients::default(),
            failures: BTreeMap::new(),
            rejected: BTreeSet::new(),
            said_of_maps: BTreeMap::new(),
            young: false,
            stopped: 0,
        };
        world.event(Event::Scanned);
        world
    }

    pub fn event(&mut self, event: Event) {
        self.clients_look();
        let another_context = self.brings_another_context(&event);
        let (mut withdrawn, mut opened) = (Vec::new(), Vec::new());
        for action in self.state.handle(self.now, event) {
            if let Action::Withdraw { path, .. } = &action {
                withdrawn.push(path.clone());
            }
            if let Action::OpenGate { path, .. } = &action {
                opened.push(path.clone());
            }
            self.is_for_clients_alone(&action);
            self.reporter_hears(&action);
            self.gate_follows(&action);
            self.act(action);
        }
        for path in withdrawn {
            self.event(Event::Withdrawn { path });
        }
        for path in opened {
            self.event(Event::Opened { path });
        }
        self.gate_must_be_true();
        self.clients_leave_no_trace();
        if another_context {
            self.context_differs();
        }
    }

    /// Returns the required bundles with their version digests.
    pub fn expected_set(&self) -> Vec<(String, Option<VersionDigest>)> {
        let version_digest = |(name, version): (&String, &Option<u8>)| {
            let version_digest = version.map(|it| {
                let started = (*name == CHILD).then(|| child(it).digest());
                VersionDigest::of(&it.to_string(), &catalogue(name), started)
            });
            (name.clone(), version_digest)
        };
        self.demanded.iter().map(version_digest).collect()
    }

    pub fn write(&mut self, file: u8) {
        self.put(file, self.stamps + 1);
    }

    /// Gives a file a new stamp with the same bytes.
    pub fn touch(&mut self, file: u8) {
        if let Some(number) = self.there.get(&path_of(file)) {
            self.put(file, self.contents[number]);
        }
    }

    pub fn put(&mut self, file: u8, content: u64) {
        self.lay(file, content);
        if file >= 8 {
            // This file is not watched.
            return self.clients_look();
        }
        self.find(file);
    }

    /// Creates a file that is not found yet.
    pub fn lay(&mut self, file: u8, content: u64) {
        self.stamps += 1;
        self.contents.insert(self.stamps, content);
        self.there.insert(path_of(file), self.stamps);
    }

    /// Reports an existing file to the state machine.
    pub fn find(&mut self, file: u8) {
        let (path, stamp) = (path_of(file), stamp(self.there[&path_of(file)]));
        // The engine does the same with files outside of the watched directories.
        self.event(if file == 7 {
            Event::Touched { path, stamp }
        } else {
            Event::Settled { path, stamp }
        });
    }

    pub fn delete(&mut self, file: u8) {
        if self.there.remove(&path_of(file)).is_some() && file < 8 {
            self.event(Event::Vanished {
                path: path_of(file),
            });
        }
    }

    pub fn is_there(&self, name: &str) -> bool {
        let mut peers = self.peers.values();
        peers.any(|it| it.name == name && !it.drained)
    }

    pub fn wait(&mut self, file: u8) {
        self.wait_until(file, None);
    }

    pub fn wait_until(&mut self, file: u8, timeout: Option<Duration>) {
        self.request_ids += 1;
        self.waiting.insert(RequestId(self.request_ids), file);
        if let Some(timeout) = timeout {
            self.until
                .insert(RequestId(self.request_ids), self.now + timeout);
        }
        let path = path_of(file);
        self.event(Event::Wait {
            request_id: RequestId(self.request_ids),
            stamp: self.there.get(&path).map(|number| stamp(*number)),
            path,
            unwatched: None,
            until: Until {
                timeout,
                reports: false,
            },
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

    /// Returns the inputs that reading a file now would give.
    pub fn inputs(&self, file: u8) -> Vec<Input> {
        let others = dependencies_of(file).iter();
        let all = std::iter::once(&file).chain(others);
        all.map(|it| self.input(*it)).collect()
    }

    pub fn pass(&mut self, time: Duration) {
        self.now += time;
        self.event(Event::Tick);
        let late = self.until.values().any(|until| *until <= self.now);
        assert!(!late, "a request with a time limit is answered in time");
    }

    /// Lets the connected bundles work until this number of files is judged.
    pub fn until_judged(&mut self, files: usize) {
        for _ in 0..100 {
            self.prepare(0, true);
            self.answer(0);
            self.store(0, true);
            if self.judged.len() >= files {
                return;
            }
        }
        panic!("expected {files} judged files, found {:?}", self.judged);
    }

    /// Lets the bundles work until this number of results is stored.
    pub fn until_stored(&mut self, results: usize) {
        for _ in 0..100 {
            if self.stored.len() >= results {
                return;
            }
            self.prepare(0, true);
            self.answer(0);
            self.answer(1);
            self.store(0, true);
        }
        panic!("too few files are stored: {:?}", self.stored);
    }

    /// Connects all bundles and lets every participant do some work.
    fn go_on(&mut self) {
        self.join("First");
        self.join("Second");
        self.child_joins();
        for n in 0..4 {
            self.prepare(n, true);
            self.answer(n);
            self.store(n, true);
            self.report(true);
            self.pool(n, true);
            self.tell_pooled();
        }
        self.pass(Duration::from_millis(300));
    }

    /// Tells the broker to stop, and waits for its end.
    pub fn drain(&mut self) {
        self.event(Event::Drain);
        for _ in 0..2000 {
            if self.stopped > 0 {
                return;
            }
            self.go_on();
        }
        panic!("the broker must stop: {:#?}", self.state.jobs);
    }

    /// Finishes all work under way while both bundles are connected.
    pub fn settle(&mut self) {
        for _ in 0..2000 {
            self.go_on();
            let all = self.demanded.values().all(Option::is_some) && self.launched.is_empty();
            let all = all && self.demanded.keys().all(|name| self.is_there(name));
            let all = all
                && self
                    .manifest
                    .is_none_or(|it| self.demanded[CHILD] == Some(it));
            let all = all && self.state.files.is_quiet() && self.state.jobs.is_empty();
            let all = all && self.shadow_rests();
            if all && self.reporter_rests() {
                assert_eq!(self.lost, BTreeSet::new(), "no result may be missing");
                return;
            }
        }
        panic!("the state machine must settle: {:#?}", self.state.jobs);
    }
}

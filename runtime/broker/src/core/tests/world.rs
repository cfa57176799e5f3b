//! A world around the state machine: it answers actions when it pleases, and knows what must be so.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use super::super::*;
use super::behind_the_gate::Published;
use super::clients::Clients;
use super::reporting::Requests;
use super::things::*;
use qcbus_messages::{JobId, Verdict};

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
    /// How long each job's file had waited when it was to be read.
    pub waited: BTreeMap<JobId, Duration>,
    pub storing: Vec<FinishedJob>,
    pub stored: Vec<u8>,
    /// Files whose results were removed by others, and have not been written again.
    pub lost: BTreeSet<u8>,
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
    pub launched: Vec<Launched>,
    /// Those of them that were killed. What they have said before may still come.
    pub dying: Vec<Launched>,
    pub killed: Vec<Launch>,
    /// Which version the manifest of the child brings, if it is there.
    pub manifest: Option<u8>,
    /// The same of the shadow.
    pub shadow: Option<u8>,
    /// What the journal has been told.
    pub members: BTreeMap<String, Member>,
    pub journal: BTreeMap<u8, Judged>,
    pub generation: u64,
    pub reconfigured: u8,
    pub request_ids: u64,
    pub waiting: BTreeMap<RequestId, u8>,
    /// Until when those wait who do not wait for ever.
    pub until: BTreeMap<RequestId, Duration>,
    /// What writers have done and the state machine has not heard.
    pub told: Vec<((u8, JobId), StoreOutcome)>,
    /// What is watched because verdicts depend on it.
    pub watched: BTreeSet<u8>,
    pub gate: Published,
    pub requests: Requests,
    pub clients: Clients,
    /// Why bundles have failed on each file, as stored.
    pub failures: BTreeMap<u8, Vec<String>>,
    /// Files with an error in them.
    pub rejected: BTreeSet<u8>,
    /// The rejected maps that the result of each file names, as stored.
    pub said_of_maps: BTreeMap<u8, Vec<u8>>,
    /// Whether files are so young that their stamps prove nothing.
    pub young: bool,
    /// How often the state machine has ended.
    pub stopped: u8,
}

/// A process that was started and has not joined.
#[derive(Clone)]
pub struct Launched {
    pub launch: Launch,
    pub name: &'static str,
    /// Of the manifest that it was started by.
    pub version: u8,
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

impl World {
    /// One in which a bundle has a job.
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
            requests: Requests::default(),
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
            self.requests_hear(&action);
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

    /// Who must judge, each as what it is.
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

    /// The same bytes under a new stamp.
    pub fn touch(&mut self, file: u8) {
        if let Some(number) = self.there.get(&path_of(file)) {
            self.put(file, self.contents[number]);
        }
    }

    pub fn put(&mut self, file: u8, content: u64) {
        self.lay(file, content);
        if file >= 8 {
            // Nobody watches it.
            return self.clients_look();
        }
        self.find(file);
    }

    /// A file lies there that nobody has found yet.
    pub fn lay(&mut self, file: u8, content: u64) {
        self.stamps += 1;
        self.contents.insert(self.stamps, content);
        self.there.insert(path_of(file), self.stamps);
    }

    /// A file that lies there is found.
    pub fn find(&mut self, file: u8) {
        let (path, stamp) = (path_of(file), stamp(self.there[&path_of(file)]));
        // As the engine does with what lies outside of the watched directories.
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

    /// What reading a file now would give.
    pub fn inputs(&self, file: u8) -> Vec<Input> {
        let others = dependencies_of(file).iter();
        let all = std::iter::once(&file).chain(others);
        all.map(|it| self.input(*it)).collect()
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

    /// Lets the bundles that are there work until so many files are judged.
    pub fn until_judged(&mut self, files: usize) {
        for _ in 0..100 {
            self.prepare(0, true);
            self.answer(0);
            self.store(0, true);
            if self.judged.len() >= files {
                return;
            }
        }
        panic!("{files} are not judged: {:?}", self.judged);
    }

    /// Lets them work until so many results are stored.
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
        panic!("only {:?} are stored", self.stored);
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
            self.pool(n, true);
            self.tell_pooled();
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
            let all = all
                && self
                    .manifest
                    .is_none_or(|it| self.demanded[CHILD] == Some(it));
            let all = all && self.state.files.is_quiet() && self.state.jobs.is_empty();
            let all = all && self.shadow_rests();
            if all && self.reporter_rests() {
                assert_eq!(self.lost, BTreeSet::new(), "results are missing");
                return;
            }
        }
        panic!(
            "the state machine does not come to rest: {:#?}",
            self.state.jobs
        );
    }
}

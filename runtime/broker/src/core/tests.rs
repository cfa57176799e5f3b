//! The state machine against a world that it cannot foresee: files come, change and go, bundles
//! answer, lie, hang and die in any order, and still every file that is there gets one verdict.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use proptest::prelude::*;
use qcbus_document::FileKind;
use qcbus_formats::xqar::{Issue, Level, Status};
use qcbus_messages::control::Response;
use qcbus_messages::{
    Catalogue, CheckerInfo, Digest, DocId, DocumentRole, FromPeer, Hello, JobDocument, JobId,
    PROTOCOL_VERSION, Role, ToPeer, Verdict,
};

use super::*;
use crate::InForce;

mod membership;
mod parts;

const CAPACITY: usize = 2;

/// A world around the state machine: it answers actions when it pleases.
struct World {
    state: State,
    now: Duration,
    /// What is there, each with the number of its stamp.
    there: HashMap<Arc<Path>, u64>,
    /// The bytes behind each stamp: a file that is touched has the same under a new one.
    contents: HashMap<u64, u64>,
    stamps: u64,
    preparing: Vec<(JobId, u8)>,
    storing: Vec<FinishedJob>,
    stored: Vec<u8>,
    peers: BTreeMap<SessionId, Bundle>,
    sessions: u64,
    judged: BTreeMap<u8, (Vec<Input>, Verdict)>,
    /// The bundles whose judgement is in the verdict of each file, as stored.
    judges: BTreeMap<u8, Vec<String>>,
    released: BTreeSet<JobId>,
    tickets: u64,
    waiting: BTreeMap<Ticket, u8>,
}

struct Bundle {
    name: &'static str,
    jobs: BTreeSet<JobId>,
}

#[derive(Debug, Clone)]
enum Step {
    Write(u8),
    Touch(u8),
    Delete(u8),
    Wait(u8),
    Join(bool),
    Kill(u8),
    Answer(u8),
    Lie(u8),
    Prepare(u8),
    NoRoom(u8),
    Store(u8),
    DiskFull(u8),
    Pass(u16),
    Reconfigure(u8),
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => (0..8_u8).prop_map(Step::Write),
        1 => (0..8_u8).prop_map(Step::Touch),
        2 => (0..8_u8).prop_map(Step::Delete),
        1 => (0..6_u8).prop_map(Step::Wait),
        2 => any::<bool>().prop_map(Step::Join),
        2 => any::<u8>().prop_map(Step::Kill),
        6 => any::<u8>().prop_map(Step::Answer),
        1 => any::<u8>().prop_map(Step::Lie),
        6 => any::<u8>().prop_map(Step::Prepare),
        1 => any::<u8>().prop_map(Step::NoRoom),
        5 => any::<u8>().prop_map(Step::Store),
        1 => any::<u8>().prop_map(Step::DiskFull),
        2 => (0..3000_u16).prop_map(Step::Pass),
        1 => (0..3_u8).prop_map(Step::Reconfigure),
    ];
    prop::collection::vec(step, 1..120)
}

/// The first six are checked, the others are only parts of them.
fn path_of(file: u8) -> Arc<Path> {
    let ending = if file < 6 { "xodr" } else { "part" };
    Path::new(&format!("/farm/{file}.{ending}")).into()
}

/// What a verdict depends on besides the file: on another that has a verdict itself, on a part of
/// its own, on a part that it shares, on all of these, or on nothing.
fn dependencies_of(file: u8) -> &'static [u8] {
    match file {
        1 => &[0, 6],
        2 => &[6],
        3 => &[4],
        5 => &[4, 6, 7],
        _ => &[],
    }
}

fn file_of(path: &Path) -> u8 {
    path.file_stem()
        .and_then(|it| it.to_str())
        .and_then(|it| it.parse().ok())
        .unwrap()
}

fn stamp(number: u64) -> Stamp {
    Stamp {
        size: number,
        mtime_ns: i128::from(number),
        ctime_ns: i128::from(number),
        inode: 1,
    }
}

fn digest(number: u64) -> Digest {
    let mut digest = Digest::default();
    digest.0[..8].copy_from_slice(&number.to_le_bytes());
    digest
}

fn basis(inputs: &[Input]) -> Digest {
    let mut basis = Digest::default();
    for (at, input) in inputs.iter().enumerate() {
        if let Some((_, digest)) = input.content {
            basis.0[at * 8..][..8].copy_from_slice(&digest.0[..8]);
        }
    }
    basis
}

fn catalogue(name: &str) -> Catalogue {
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

fn finding() -> Issue {
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
    fn new() -> World {
        let in_force = InForce::new(None).unwrap();
        let settings = Settings {
            collect: Duration::ZERO,
            max_active: 4,
            max_preparing: 2,
            max_storing: 2,
            max_findings_bytes: 1000,
            ..Settings::default()
        };
        let mut world = World {
            state: State::new(settings, in_force.digest, in_force.demand()),
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
            tickets: 0,
            waiting: BTreeMap::new(),
        };
        world.event(Event::Scanned);
        world
    }

    fn event(&mut self, event: Event) {
        for action in self.state.handle(self.now, event) {
            self.act(action);
        }
    }

    fn act(&mut self, action: Action) {
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
            Action::Disconnect { session } | Action::Refuse { session, .. } => {
                self.peers.remove(&session);
            }
            Action::Store(job) => {
                let names: BTreeSet<_> = job.bundles.iter().map(|it| it.name.clone()).collect();
                assert_eq!(
                    names.len(),
                    job.bundles.len(),
                    "no bundle is in a result twice"
                );
                for bundle in &job.bundles {
                    assert_eq!(bundle.checkers.len(), 2, "every demanded checker is there");
                }
                self.storing.push(*job);
            }
            Action::Judged { path, judged, .. } => {
                let verdict = (judged.inputs.clone(), judged.verdict);
                self.judged.insert(file_of(&path), verdict);
            }
            Action::Answer { ticket, response } => {
                let file = self.waiting.remove(&ticket).expect("one answer for each");
                if matches!(response, Response::Verdict(_)) {
                    let told = self.state.inputs_of(&path_of(file));
                    assert_eq!(told, self.inputs(file), "the answer is true at that moment");
                }
            }
            Action::Withdraw { path, .. } => {
                self.judged.remove(&file_of(&path));
            }
            _ => {}
        }
    }

    fn write(&mut self, file: u8) {
        self.put(file, self.stamps + 1);
    }

    /// The same bytes under a new stamp.
    fn touch(&mut self, file: u8) {
        if let Some(number) = self.there.get(&path_of(file)) {
            self.put(file, self.contents[number]);
        }
    }

    fn put(&mut self, file: u8, content: u64) {
        self.stamps += 1;
        self.contents.insert(self.stamps, content);
        self.there.insert(path_of(file), self.stamps);
        let stamp = stamp(self.stamps);
        self.event(Event::Settled {
            path: path_of(file),
            stamp,
        });
    }

    fn delete(&mut self, file: u8) {
        if self.there.remove(&path_of(file)).is_some() {
            self.event(Event::Vanished {
                path: path_of(file),
            });
        }
    }

    fn wait(&mut self, file: u8) {
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

    fn names_that_judged(&self, file: u8) -> Vec<&str> {
        self.judges[&file].iter().map(String::as_str).collect()
    }

    fn input(&self, file: u8) -> Input {
        let path = path_of(file);
        let number = self.there.get(&path);
        Input {
            content: number.map(|it| (stamp(*it), digest(self.contents[it]))),
            path,
        }
    }

    /// What reading a file now would give.
    fn inputs(&self, file: u8) -> Vec<Input> {
        let others = dependencies_of(file).iter();
        let all = std::iter::once(&file).chain(others);
        all.map(|it| self.input(*it)).collect()
    }

    fn join(&mut self, name: &'static str) {
        if self.peers.values().any(|bundle| bundle.name == name) {
            return;
        }
        self.sessions += 1;
        let session = SessionId(self.sessions);
        self.peers.insert(
            session,
            Bundle {
                name,
                jobs: BTreeSet::new(),
            },
        );
        let hello = Hello {
            protocol: PROTOCOL_VERSION,
            role: Role::Bundle,
            name: name.to_owned(),
            version: "1".to_owned(),
            incarnation: self.sessions,
            pid: u32::try_from(self.sessions).unwrap() + 1000,
            launch: None,
            capacity: u16::try_from(CAPACITY).unwrap(),
        };
        self.event(Event::Hello { session, hello });
        self.say(session, FromPeer::Catalogue(Box::new(catalogue(name))));
    }

    fn say(&mut self, session: SessionId, message: FromPeer) {
        if self.peers.contains_key(&session) {
            self.event(Event::Message { session, message });
        }
    }

    fn nth_peer(&self, n: u8) -> Option<SessionId> {
        let count = self.peers.len();
        (count > 0).then(|| *self.peers.keys().nth(usize::from(n) % count).unwrap())
    }

    fn kill(&mut self, n: u8) {
        if let Some(session) = self.nth_peer(n) {
            self.peers.remove(&session);
            self.event(Event::Gone { session });
        }
    }

    fn answer(&mut self, n: u8) {
        let Some(session) = self.nth_peer(n) else {
            return;
        };
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
                    status: Status::Completed,
                    reason: String::new(),
                    params: Vec::new(),
                    metadata: Vec::new(),
                },
            );
        }
        self.say(session, FromPeer::JobDone { job, micros: 1 });
    }

    fn prepare(&mut self, n: u8, room: bool) {
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

    fn store(&mut self, n: u8, room: bool) {
        if self.storing.is_empty() {
            return;
        }
        let job = self.storing.remove(usize::from(n) % self.storing.len());
        let file = file_of(&job.path);
        let prepared = job.prepared.as_ref().unwrap();
        let outcome = if prepared.inputs != self.inputs(file) {
            StoreOutcome::Stale
        } else if !room {
            StoreOutcome::Failed("full".to_owned())
        } else {
            self.stored.push(file);
            let names = job.bundles.iter().map(|it| it.name.clone());
            self.judges.insert(file, names.collect());
            let failed = job.bundles.iter().any(|bundle| bundle.failure.is_some());
            StoreOutcome::Stored(Box::new(Judged {
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
            }))
        };
        self.event(Event::Stored {
            job: job.job,
            outcome,
        });
    }

    fn step(&mut self, step: &Step) {
        match *step {
            Step::Write(file) => self.write(file),
            Step::Touch(file) => self.touch(file),
            Step::Delete(file) => self.delete(file),
            Step::Wait(file) => self.wait(file),
            Step::Join(first) => self.join(if first { "First" } else { "Second" }),
            Step::Kill(n) => self.kill(n),
            Step::Answer(n) => self.answer(n),
            Step::Lie(n) => {
                if let Some(session) = self.nth_peer(n) {
                    let job = JobId(u64::from(n) << 20);
                    self.say(session, FromPeer::JobDone { job, micros: 0 });
                }
            }
            Step::Prepare(n) => self.prepare(n, true),
            Step::NoRoom(n) => self.prepare(n, false),
            Step::Store(n) => self.store(n, true),
            Step::DiskFull(n) => self.store(n, false),
            Step::Pass(millis) => self.pass(Duration::from_millis(millis.into())),
            Step::Reconfigure(n) => {
                let in_force = InForce::new(None).unwrap();
                let event = Event::Configured {
                    digest: digest(n.into()),
                    demand: in_force.demand(),
                };
                self.event(event);
            }
        }
    }

    fn pass(&mut self, time: Duration) {
        self.now += time;
        self.event(Event::Tick);
    }

    /// Lets everything that is under way come to its end, with both bundles there.
    fn settle(&mut self) {
        for _ in 0..2000 {
            self.join("First");
            self.join("Second");
            for n in 0..4 {
                self.prepare(n, true);
                self.answer(n);
                self.store(n, true);
            }
            self.pass(Duration::from_millis(300));
            if self.state.files.is_quiet() && self.state.jobs.is_empty() {
                return;
            }
        }
        panic!(
            "the state machine does not come to rest: {:#?}",
            self.state.jobs
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whatever happens in whatever order: once the world calms down, every file that is there has
    /// a verdict on its present bytes and those of all that it depends on, none that has gone has
    /// one, whoever waits has an answer, and nothing is left in flight.
    #[test]
    fn every_file_gets_its_verdict_whatever_happens(steps in steps()) {
        let mut world = World::new();
        for step in &steps {
            world.step(step);
        }
        world.settle();
        let there = |file: &u8| world.there.contains_key(&path_of(*file));
        let present: BTreeMap<u8, Vec<Input>> =
            (0..6).filter(there).map(|file| (file, world.inputs(file))).collect();
        let judged: BTreeMap<u8, Vec<Input>> =
            world.judged.iter().map(|(file, (inputs, _))| (*file, inputs.clone())).collect();
        prop_assert_eq!(judged, present);
        prop_assert!(!world.waiting.values().any(there), "{:?}", world.waiting);
        prop_assert_eq!(world.state.preparing, 0);
        prop_assert_eq!(world.state.storing, 0);
    }
}

fn judged_world() -> World {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.settle();
    world
}

#[test]
fn a_file_that_has_not_changed_is_not_judged_again() {
    let mut world = judged_world();
    let before = world.stored.len();
    let stamp = stamp(world.there[&path_of(1)]);
    world.event(Event::Settled {
        path: path_of(1),
        stamp,
    });
    world.settle();
    assert_eq!(world.stored.len(), before);
}

#[test]
fn a_bundle_that_joins_later_judges_old_files_in_the_background() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    while world.judged.is_empty() {
        world.prepare(0, true);
        world.answer(0);
        world.store(0, true);
    }
    assert_eq!(world.stored.len(), 1);
    world.join("Second");
    world.settle();
    assert_eq!(world.stored.len(), 2);
}

#[test]
fn a_pair_that_dies_twice_alone_is_condemned_and_not_tried_again() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    let mut deaths = 0;
    while world.judged.is_empty() {
        world.join("First");
        world.prepare(0, true);
        if world.peers.values().any(|bundle| !bundle.jobs.is_empty()) {
            world.kill(0);
            deaths += 1;
        }
        world.store(0, true);
        world.pass(Duration::from_millis(10));
        assert!(deaths < 10, "a poison pair must end");
    }
    // Once in company (it does not count), then twice alone in a fresh process.
    assert_eq!(deaths, 3);
    assert_eq!(world.judged[&1].1, Verdict::Undetermined);
    world.settle();
    let stored = world.stored.len();
    world.pass(Duration::from_secs(60));
    world.settle();
    assert_eq!(world.stored.len(), stored);
}

#[test]
fn a_bundle_that_hangs_is_given_up_after_its_deadline() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    assert_eq!(world.peers.len(), 1);
    world.pass(world.state.settings.silence_limit + Duration::from_secs(1));
    assert!(
        world.peers.is_empty(),
        "the silent bundle's session is closed"
    );
}

#[test]
fn a_killed_bundle_stays_demanded_until_nobody_can_hope_for_it() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    world.kill(0);
    world.store(0, true);
    assert!(world.judged.is_empty(), "its job waits for it");
    world.pass(world.state.settings.absence_limit);
    world.store(0, true);
    assert_eq!(world.judged[&1].1, Verdict::Undetermined);
}

#[test]
fn files_are_judged_again_without_a_bundle_that_has_left() {
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    world.write(1);
    world.settle();
    let stored = world.stored.len();
    let second = world
        .peers
        .iter()
        .find(|(_, bundle)| bundle.name == "Second");
    let session = *second.unwrap().0;
    world.say(session, FromPeer::Leaving);
    for n in 0..4 {
        world.prepare(n, true);
        world.answer(n);
        world.store(n, true);
    }
    assert_eq!(world.stored.len(), stored + 1);
}

/// A bundle that a former broker started (it has a launch) and that no manifest names any more.
fn world_with_an_unwanted_bundle() -> (World, SessionId) {
    let mut world = World::new();
    world.join("First");
    let session = SessionId(77);
    world.peers.insert(
        session,
        Bundle {
            name: "Left over",
            jobs: BTreeSet::new(),
        },
    );
    let hello = Hello {
        protocol: PROTOCOL_VERSION,
        role: Role::Bundle,
        name: "LeftOver".to_owned(),
        version: "1".to_owned(),
        incarnation: 77,
        pid: 7777,
        launch: Some(77),
        capacity: 1,
    };
    let actions = world
        .state
        .handle(world.now, Event::Hello { session, hello });
    let drained = actions.iter().any(|action| {
        matches!(action, Action::Send { session: to, message: ToPeer::Drain } if *to == session)
    });
    assert!(drained, "nobody wants it: {actions:?}");
    world.say(
        session,
        FromPeer::Catalogue(Box::new(catalogue("LeftOver"))),
    );
    (world, session)
}

#[test]
fn a_bundle_left_over_from_a_former_broker_takes_no_part() {
    let (mut world, session) = world_with_an_unwanted_bundle();
    world.write(1);
    world.settle();
    assert_eq!(world.judged[&1].1, Verdict::Accepted);
    assert!(world.peers[&session].jobs.is_empty());
}

#[test]
fn a_bundle_that_does_not_go_is_made_to() {
    let (mut world, session) = world_with_an_unwanted_bundle();
    world.pass(Duration::from_secs(60));
    assert!(!world.peers.contains_key(&session));
    assert!(!world.state.bundles.contains_key("LeftOver"));
}

#[test]
fn a_cancelled_job_makes_room_for_the_next() {
    let mut world = World::new();
    world.join("First");
    for file in 0..2 {
        world.write(file);
        world.prepare(0, true);
    }
    // Both become suspects, which are given out one at a time.
    world.kill(0);
    world.join("First");
    let given = |world: &World| -> Vec<JobId> {
        let jobs = world.peers.values().flat_map(|bundle| &bundle.jobs);
        jobs.copied().collect()
    };
    let first = given(&world);
    assert_eq!(first.len(), 1);
    let file = file_of(&world.state.jobs[&first[0]].path);
    world.delete(file);
    let second = given(&world);
    assert_eq!(second.len(), 1);
    assert_ne!(first, second);
}

#[test]
fn jobs_wait_while_findings_take_up_the_room() {
    let mut world = World::new();
    world.join("First");
    for file in 0..4 {
        world.write(file);
        world.prepare(0, true);
    }
    let held = |world: &World| -> usize {
        let jobs = world.state.jobs.values();
        let shares = jobs.flat_map(|job| job.shares.values());
        shares.map(|share| share.staged_bytes).sum()
    };
    // Both given jobs are answered with more than there is room for, and nothing is stored.
    world.answer(2);
    world.answer(2);
    assert!(held(&world) > world.state.settings.max_findings_bytes);
    let given: usize = world.peers.values().map(|bundle| bundle.jobs.len()).sum();
    assert_eq!(given, 0, "the others wait");
    world.settle();
    assert_eq!(world.judged.len(), 4);
}

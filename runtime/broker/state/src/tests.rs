//! Tests of the state machine in random worlds. Files come, change and go, and bundles answer, lie,
//! hang and die in any order. Every present file must still get one verdict.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use proptest::prelude::*;
use qcbus_configuration::InForce;
use qcbus_ingest::modular::SearchPath;
use qcbus_messages::{FromPeer, JobId, ToPeer, Verdict};
use qcbus_types::ChildEnd;

use super::*;

mod actions;
mod behind_the_gate;
mod children;
mod clients;
mod dependencies;
mod early;
mod ending;
mod exits;
mod flapping;
mod invariants;
mod limits;
mod membership;
mod on_demand;
mod outputs;
mod processes;
mod reporting;
mod rests_on;
mod things;
mod trials;
mod unfinished;
mod words;
mod world;

use things::*;
use world::*;

#[derive(Debug, Clone)]
enum Step {
    Write(u8),
    Spoil(u8),
    Touch(u8),
    Delete(u8),
    Lose(u8),
    Wait(u8),
    WaitBriefly(u8),
    Join(bool),
    Kill(u8),
    Answer(u8),
    Begin(u8),
    Lie(u8),
    Prepare(u8),
    NoRoom(u8),
    Store(u8),
    DiskFull(u8),
    WriteOut(u8),
    Tell,
    Report(bool),
    ReporterDies,
    Pass(u16),
    Reconfigure(u8),
    Upgrade(bool),
    Leave(u8),
    Remove(u8),
    Manifest(u8),
    Shadow(u8),
    ChildJoins,
    ChildJoinsTooLate(bool),
    ChildEnds(u8),
    Restart,
    RestartAfter(u8, bool),
    OnDemand(u8, bool),
    ClientLeaves(u8),
    PoolOnDemand(u8, bool),
    TellPooled,
}

fn steps() -> impl Strategy<Value = Vec<Step>> {
    let step = prop_oneof![
        4 => (0..11_u8).prop_map(Step::Write),
        2 => (0..6_u8).prop_map(Step::Spoil),
        1 => (0..11_u8).prop_map(Step::Touch),
        2 => (0..11_u8).prop_map(Step::Delete),
        2 => (0..6_u8).prop_map(Step::Lose),
        1 => (0..6_u8).prop_map(Step::Wait),
        1 => (0..6_u8).prop_map(Step::WaitBriefly),
        2 => any::<bool>().prop_map(Step::Join),
        2 => any::<u8>().prop_map(Step::Kill),
        6 => any::<u8>().prop_map(Step::Answer),
        1 => any::<u8>().prop_map(Step::Begin),
        1 => any::<u8>().prop_map(Step::Lie),
        6 => any::<u8>().prop_map(Step::Prepare),
        1 => any::<u8>().prop_map(Step::NoRoom),
        5 => any::<u8>().prop_map(Step::Store),
        1 => any::<u8>().prop_map(Step::DiskFull),
        2 => any::<u8>().prop_map(Step::WriteOut),
        2 => Just(Step::Tell),
        4 => prop::bool::weighted(0.8).prop_map(Step::Report),
        1 => Just(Step::ReporterDies),
        2 => (0..3000_u16).prop_map(Step::Pass),
        1 => (0..3_u8).prop_map(Step::Reconfigure),
        1 => any::<bool>().prop_map(Step::Upgrade),
        1 => any::<u8>().prop_map(Step::Leave),
        1 => (0..3_u8).prop_map(Step::Remove),
        2 => (0..3_u8).prop_map(Step::Manifest),
        1 => (0..3_u8).prop_map(Step::Shadow),
        2 => Just(Step::ChildJoins),
        1 => any::<bool>().prop_map(Step::ChildJoinsTooLate),
        1 => (0..4_u8).prop_map(Step::ChildEnds),
        1 => Just(Step::Restart),
        1 => ((0..8_u8), any::<bool>()).prop_map(|(file, late)| Step::RestartAfter(file, late)),
        4 => ((2..10_u8), prop::bool::weighted(0.8)).prop_map(|(file, known)| Step::OnDemand(file, known)),
        1 => any::<u8>().prop_map(Step::ClientLeaves),
        4 => (any::<u8>(), prop::bool::weighted(0.8)).prop_map(|(n, well)| Step::PoolOnDemand(n, well)),
        3 => Just(Step::TellPooled),
    ];
    prop::collection::vec(step, 1..120)
}

impl World {
    fn step(&mut self, step: &Step) {
        match *step {
            Step::Write(file) => self.write(file),
            Step::Spoil(file) => self.put(file, BAD + self.stamps + 1),
            Step::Touch(file) => self.touch(file),
            Step::Delete(file) => self.delete(file),
            Step::Lose(file) => self.lose(file),
            Step::Wait(file) => self.wait(file),
            Step::WaitBriefly(file) => self.wait_until(file, Some(Duration::from_millis(700))),
            Step::Join(first) => self.join(if first { "First" } else { "Second" }),
            Step::Kill(n) => self.kill(n),
            Step::Answer(n) => self.answer(n),
            Step::Begin(n) => self.begin(n),
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
            Step::WriteOut(n) => self.write_out(n, true),
            Step::Tell => self.tell(),
            Step::Report(heard) => self.report(heard),
            Step::ReporterDies => self.reporter_dies(),
            Step::Pass(millis) => self.pass(Duration::from_millis(millis.into())),
            Step::Upgrade(first) => {
                let name = if first { "First" } else { "Second" };
                *self.versions.entry(name).or_insert(1) += 1;
            }
            Step::Leave(n) => self.leave(n),
            Step::Remove(n) => self.remove(["First", "Second", CHILD][usize::from(n)]),
            // The child is absent or has one of two versions.
            Step::Manifest(n) => self.manifest((n > 0).then_some(n)),
            Step::Shadow(n) => self.shadow_is((n > 0).then_some(n)),
            Step::ChildJoins => self.child_joins(),
            Step::ChildJoinsTooLate(known) => self.child_joins_too_late(known),
            Step::ChildEnds(n) => self.child_ends(match n {
                0 => ChildEnd::NotStarted("no such program".to_owned()),
                1 => ChildEnd::Done("it ended".to_owned()),
                _ => ChildEnd::Failed("it crashed".to_owned()),
            }),
            Step::Restart => self.restart(),
            Step::RestartAfter(file, unsettled) => self.restart_after(file, unsettled),
            Step::OnDemand(file, known) => self.somebody_asks(file, known),
            Step::ClientLeaves(n) => self.client_leaves(n),
            Step::PoolOnDemand(n, well) => self.pool(n, well),
            Step::TellPooled => self.tell_pooled(),
            Step::Reconfigure(n) => self.reconfigure(n),
        }
    }

    fn reconfigure(&mut self, number: u8) {
        self.reconfigured = number;
        let in_force = InForce::new(None, SearchPath::default()).unwrap();
        let event = Event::Configured {
            digest: digest(number.into()),
            demand: in_force.demand(),
        };
        self.event(event);
    }
}

/// Returns the number of random worlds. `QCBUS_WORLDS` sets a larger number for nightly runs.
fn worlds() -> u32 {
    let wanted = std::env::var("QCBUS_WORLDS").ok();
    wanted.and_then(|it| it.parse().ok()).unwrap_or(400)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(worlds()))]

    /// Checks the final state after random steps, once the world has settled. Every present file
    /// has a verdict on its present bytes and those of all its dependencies. No removed file has a
    /// verdict, every waiting client has an answer, and no work is in flight.
    #[test]
    fn every_file_gets_its_verdict_after_random_steps(steps in steps()) {
        let mut world = World::with_a_reporter();
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
        for file in world.judged.keys() {
            let id = world.state.files.id(&path_of(*file)).unwrap();
            let judged = world.state.files.get(id).unwrap().judged.clone().unwrap();
            prop_assert_eq!(named(&judged.required_set), world.expected_set());
            prop_assert_eq!(&world.journal[file], &*judged, "the journal has the same verdict");
            prop_assert_eq!(judged.verdict, world.verdict_with_all(*file, judged.own));
            // When all bundles are present, only a file that kills bundles may prevent a verdict.
            let why = &world.failures[file];
            prop_assert!(why.iter().all(|it| it.contains("new process with only this file")), "{:?}", why);
        }
        world.all_know_the_same();
        world.all_is_tried();
        prop_assert!(!world.waiting.values().any(there), "{:?}", world.waiting);
        world.clients_are_content();
        let known = world.state.status().files;
        let counted = [known.total, known.judged];
        prop_assert_eq!(counted, [world.judged.len() as u64; 2], "clients' files do not count");
        prop_assert_eq!(world.state.preparing, 0);
        prop_assert_eq!(world.state.storing, 0);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(worlds() / 4))]

    /// Checks that a broker always stops once after it is told to, and that every waiting client gets an answer.
    #[test]
    fn every_broker_stops_after_random_steps(steps in steps()) {
        let mut world = World::with_a_reporter();
        for step in &steps {
            world.step(step);
        }
        world.drain();
        prop_assert_eq!(world.stopped, 1);
        prop_assert!(world.waiting.is_empty(), "{:?}", world.waiting);
        world.clients_are_content();
    }
}

impl World {
    /// Asserts that gate, reporter and journal agree on the verdicts once the world has settled.
    fn all_know_the_same(&self) {
        let accepted = |(file, (_, verdict)): (&u8, &(Vec<Input>, Verdict))| {
            (*verdict == Verdict::Accepted).then_some(*file)
        };
        let accepted: Vec<u8> = self.judged.iter().filter_map(accepted).collect();
        let published: Vec<u8> = self.gate.keys().copied().collect();
        assert_eq!(
            published, accepted,
            "exactly the accepted files are published"
        );
        let newest: BTreeMap<u8, JobId> = self
            .journal
            .iter()
            .map(|(file, it)| (*file, it.job))
            .collect();
        assert_eq!(
            self.reporter_state.reports, newest,
            "the reporter has every newest result"
        );
        assert_eq!(
            self.reporter_state.delivered, newest,
            "the journal records every delivery"
        );
        assert_eq!(self.reporter_state.voids, BTreeSet::new());
        let judged = self.judged.keys();
        let needed: BTreeSet<u8> = judged
            .flat_map(|file| dependencies_of(*file).iter().copied())
            .collect();
        assert_eq!(
            self.watched, needed,
            "every dependency of a verdict is watched"
        );
        let members = self.members.iter();
        let members: BTreeMap<String, Option<u8>> = members
            .map(|(name, it)| (name.clone(), it.version.parse().ok()))
            .collect();
        assert_eq!(
            members, self.demanded,
            "the required bundles are in the journal"
        );
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
fn unchanged_file_is_not_judged_again() {
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
fn late_bundle_judges_old_files_in_background() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.until_judged(1);
    assert_eq!(world.stored.len(), 1);
    world.join("Second");
    world.settle();
    assert_eq!(world.stored.len(), 2);
}

#[test]
fn file_that_kills_bundle_twice_alone_is_not_retried() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    let (mut deaths, mut rounds) = (0, 0);
    while world.judged.is_empty() {
        world.join("First");
        world.prepare(0, true);
        if world.peers.values().any(|bundle| !bundle.jobs.is_empty()) {
            world.kill(0);
            deaths += 1;
        }
        world.store(0, true);
        world.pass(Duration::from_millis(10));
        rounds += 1;
        assert!(rounds < 100, "the attempts with a deadly file must end");
    }
    // It dies once together with other jobs (this does not count), then twice alone in a fresh process.
    assert_eq!(deaths, 3);
    assert_eq!(world.judged[&1].1, Verdict::Undetermined);
    world.settle();
    let stored = world.stored.len();
    world.pass(Duration::from_secs(60));
    world.settle();
    assert_eq!(world.stored.len(), stored);
}

#[test]
fn hanging_bundle_is_disconnected_after_silence_limit() {
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
fn killed_bundle_stays_required_until_absence_limit() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    world.kill(0);
    world.store(0, true);
    assert!(world.judged.is_empty(), "the job waits for the bundle");
    world.pass(world.state.settings.absence_limit);
    world.store(0, true);
    assert_eq!(world.judged[&1].1, Verdict::Undetermined);
}

#[test]
fn files_are_judged_again_without_bundle_that_left() {
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
    world.demanded.remove("Second");
    world.say(session, FromPeer::Leaving);
    for n in 0..4 {
        world.prepare(n, true);
        world.answer(n);
        world.store(n, true);
    }
    assert_eq!(world.stored.len(), stored + 1);
}

/// Returns a world with a bundle that a former broker started (it has a launch) and that no manifest names any more.
fn world_with_an_unwanted_bundle() -> (World, SessionId) {
    let mut world = World::new();
    world.join("First");
    let session = SessionId(77);
    world.peers.insert(
        session,
        Process {
            name: "LeftOver",
            jobs: BTreeSet::new(),
            begun: BTreeSet::new(),
            drained: false,
        },
    );
    let hello = hello(session, "LeftOver", 1, Some(77));
    let actions = world
        .state
        .handle(world.now, Event::Hello { session, hello });
    let drained = actions.iter().any(|action| {
        matches!(action, Action::Send { session: to, message: ToPeer::Drain } if *to == session)
    });
    assert!(drained, "an unwanted bundle is drained: {actions:?}");
    world.say(
        session,
        FromPeer::Catalogue(Box::new(catalogue("LeftOver"))),
    );
    (world, session)
}

#[test]
fn stale_bundle_of_former_broker_gets_no_jobs() {
    let (mut world, session) = world_with_an_unwanted_bundle();
    world.write(1);
    world.settle();
    assert_eq!(world.judged[&1].1, Verdict::Accepted);
    assert!(world.peers[&session].jobs.is_empty());
}

#[test]
fn unwanted_bundle_that_stays_is_disconnected() {
    let (mut world, session) = world_with_an_unwanted_bundle();
    world.pass(Duration::from_secs(60));
    assert!(!world.peers.contains_key(&session));
    assert!(!world.state.bundles.contains_key("LeftOver"));
}

#[test]
fn stale_children_are_killed_once() {
    let mut world = World::new();
    world.generation = 2;
    world.state = fresh_state(2, 0);
    world.manifest(Some(1));
    world.stale_child_joins(1, &child(1));
    let launch = world.state.bundles[CHILD].launch.unwrap();
    let session = world.nth_peer(0).unwrap();
    let mut killed = Vec::new();
    for seconds in [7, 14, 16, 23, 30] {
        let alive = FromPeer::Heartbeat {
            job: None,
            checker: None,
        };
        world.say(session, alive);
        world.now = Duration::from_secs(seconds);
        let actions = world.state.handle(world.now, Event::Tick);
        killed.extend(actions.into_iter().filter_map(|action| match action {
            Action::KillStaleChildren { joined } => Some((seconds, joined)),
            _ => None,
        }));
    }
    assert_eq!(killed, [(16, BTreeSet::from([launch]))]);
}

#[test]
fn cancelled_job_makes_room_for_next() {
    let mut world = World::new();
    world.join("First");
    for file in 0..2 {
        world.write(file);
        world.prepare(0, true);
    }
    // Both files are in quarantine now and are handed out one at a time.
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
fn jobs_wait_while_findings_exceed_memory_limit() {
    let mut world = World::new();
    world.join("First");
    for file in 0..4 {
        world.write(file);
        world.prepare(0, true);
    }
    let held = |world: &World| -> usize {
        let jobs = world.state.jobs.values();
        let tasks = jobs.flat_map(|job| job.tasks.values());
        tasks.map(|task| task.pending_bytes).sum()
    };
    // Both jobs are answered with more findings than there is room for, and no result is stored.
    world.answer(2);
    world.answer(2);
    assert!(held(&world) > world.state.settings.max_findings_bytes);
    let given: usize = world.peers.values().map(|bundle| bundle.jobs.len()).sum();
    assert_eq!(given, 0, "the other jobs wait");
    world.settle();
    assert_eq!(world.judged.len(), 4);
}

//! Tests of the required bundles: joins, leaves and upgrades while files are being checked.

use qcbus_document::FileKind;
use qcbus_messages::Catalogue;

use super::*;

/// Returns the session of a present bundle.
fn session_of(world: &World, name: &str) -> SessionId {
    let found = world.peers.iter().find(|(_, bundle)| bundle.name == name);
    *found.unwrap().0
}

/// Returns a world with a file at the writers, checked by the first bundle alone.
pub fn world_with_a_file_at_the_writers() -> World {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    world.answer(0);
    assert_eq!(world.storing.len(), 1);
    world
}

#[test]
fn file_in_progress_is_also_judged_by_joining_bundle() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    world.join("Second");
    let second = session_of(&world, "Second");
    assert_eq!(
        world.peers[&second].jobs.len(),
        1,
        "the new bundle gets its task at once"
    );
    world.settle();
    assert_eq!(world.names_that_judged(1), ["First", "Second"]);
}

#[test]
fn file_being_written_when_bundle_joins_is_judged_again() {
    let mut world = world_with_a_file_at_the_writers();
    world.join("Second");
    world.store(0, true);
    world.settle();
    assert_eq!(world.names_that_judged(1), ["First", "Second"]);
}

/// Returns a world with six judged files. When all are checked again, only four can be active, so the others wait.
fn world_that_is_busy() -> World {
    let mut world = World::new();
    world.join("First");
    for file in 0..6 {
        world.write(file);
    }
    world.until_judged(6);
    world
}

#[test]
fn waiting_client_gets_no_verdict_without_new_bundle() {
    let mut world = world_that_is_busy();
    world.join("Second");
    for file in 0..6 {
        world.wait(file);
    }
    assert_eq!(
        world.waiting.len(),
        6,
        "the second bundle has not judged yet"
    );
    world.settle();
    assert!(world.waiting.is_empty());
}

#[test]
fn waiting_client_gets_no_verdict_of_old_configuration() {
    let mut world = world_that_is_busy();
    world.step(&Step::Reconfigure(2));
    for file in 0..6 {
        world.wait(file);
    }
    assert_eq!(
        world.waiting.len(),
        6,
        "some files wait in the background queue"
    );
    world.settle();
    assert!(world.waiting.is_empty());
}

#[test]
fn late_messages_on_cancelled_jobs_are_no_violation() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.write(4);
    let session = session_of(&world, "First");
    for round in 0..100_u8 {
        world.prepare(0, true);
        world.prepare(0, true);
        let jobs: Vec<JobId> = world.peers[&session].jobs.iter().copied().collect();
        assert_eq!(jobs.len(), 2);
        // The jobs are cancelled and handed out again while the bundle's messages were on their way.
        world.step(&Step::Reconfigure(round % 2));
        for job in jobs {
            world.say(session, FromPeer::JobDone { job, micros: 1 });
        }
    }
    assert!(
        world.peers.contains_key(&session),
        "the bundle made no error"
    );
}

#[test]
fn messages_on_unknown_jobs_are_violations() {
    let mut world = World::new();
    world.join("First");
    let session = session_of(&world, "First");
    for number in 0..100 {
        let job = JobId((1 << 40) + number);
        world.say(session, FromPeer::JobDone { job, micros: 1 });
    }
    assert!(!world.peers.contains_key(&session));
}

#[test]
fn forgotten_job_is_noticed_while_others_finish() {
    let mut world = World::new();
    world.join("First");
    let session = session_of(&world, "First");
    world.write(0);
    world.prepare(0, true);
    let forgotten = *world.peers[&session].jobs.first().unwrap();
    let mut passed = Duration::ZERO;
    while world.peers.contains_key(&session) {
        assert!(
            passed < Duration::from_secs(600),
            "the forgotten job must be noticed"
        );
        world.write(4);
        world.prepare(0, true);
        let others: Vec<JobId> = world.peers[&session].jobs.iter().copied().collect();
        for job in others.into_iter().filter(|job| *job != forgotten) {
            world.peers.get_mut(&session).unwrap().jobs.remove(&job);
            world.say(session, FromPeer::JobDone { job, micros: 1 });
        }
        world.store(0, true);
        world.pass(Duration::from_secs(5));
        passed += Duration::from_secs(5);
    }
}

/// A configuration that names a bundle.
#[derive(Debug)]
struct Naming(&'static str);

impl Demand for Naming {
    fn wants_bundle(&self, _: &str, _: &str) -> bool {
        true
    }

    fn checkers(&self, _: &str, catalogue: &Catalogue, _: FileKind) -> Vec<u32> {
        (0..).take(catalogue.checkers.len()).collect()
    }

    fn named(&self) -> Vec<String> {
        vec![self.0.to_owned()]
    }

    fn means(&self, named: &str, name: &str, _: &str) -> bool {
        named == name
    }
}

#[test]
fn bundle_named_only_in_configuration_is_required_at_once() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.until_judged(1);
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
    world.reconfigured = 1;
    world.demanded.insert("Second".to_owned(), None);
    let event = Event::Configured {
        digest: digest(1),
        demand: Arc::new(Naming("Second")),
    };
    world.event(event);
    world.until_stored(2);
    assert_eq!(world.judged[&0].1, Verdict::Undetermined);
    world.join("Second");
    world.until_stored(3);
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
    assert_eq!(world.names_that_judged(0), ["First", "Second"]);
}

/// Lets a process say hello and, optionally, send its catalogue.
fn comes(world: &mut World, name: &'static str, offer: Option<Catalogue>) {
    world.sessions += 1;
    let session = SessionId(world.sessions);
    let hello = hello(session, name, 1, None);
    world.event(Event::Hello { session, hello });
    if let Some(offer) = offer {
        let message = FromPeer::Catalogue(Box::new(offer));
        world.event(Event::Message { session, message });
    }
}

#[test]
fn findings_are_kept_when_bundle_joins_before_writing() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.prepare(0, true);
    world.answer(0);
    assert_eq!(world.storing.len(), 1);
    world.join("Second");
    world.store(0, true);
    assert!(
        world.judged.is_empty(),
        "the result belongs to an older epoch"
    );
    assert!(world.preparing.is_empty(), "no file is read again");
    let first = world.peers.values().find(|it| it.name == "First").unwrap();
    assert!(first.jobs.is_empty(), "no bundle is asked twice");
    world.settle();
    assert_eq!(world.names_that_judged(0), ["First", "Second"]);
}

#[test]
fn bundle_without_catalogue_gets_no_job() {
    let mut world = World::new();
    world.join("Second");
    world.restart();
    world.write(0);
    world.prepare(0, true);
    // The journal has the last catalogue of the bundle, but the bundle may offer another one now.
    let session = SessionId(99);
    let hello = hello(session, "Second", 1, None);
    let event = Event::Hello { session, hello };
    let is_job = |action: &Action| {
        let Action::Send { message, .. } = action else {
            return false;
        };
        matches!(message, ToPeer::Job(_))
    };
    let mut said = world.state.handle(world.now, event);
    said.extend(world.state.handle(world.now, Event::Tick));
    assert!(!said.iter().any(is_job), "{said:?}");
    let message = FromPeer::Catalogue(Box::new(catalogue("Second")));
    let event = Event::Message { session, message };
    let said = world.state.handle(world.now, event);
    assert!(said.iter().any(is_job), "{said:?}");
}

#[test]
fn bundle_without_catalogue_is_not_required() {
    let mut world = World::new();
    comes(&mut world, "Mute", None);
    world.join("First");
    world.write(0);
    world.until_judged(1);
    assert_eq!(world.names_that_judged(0), ["First"]);
}

#[test]
fn configured_bundle_for_other_file_kind_is_not_applicable() {
    let mut world = World::new();
    world.reconfigured = 1;
    let event = Event::Configured {
        digest: digest(1),
        demand: Arc::new(Naming("Scenes")),
    };
    world.event(event);
    let mut scenes = catalogue("Scenes");
    scenes.kinds = vec![FileKind::Xosc];
    comes(&mut world, "Scenes", Some(scenes));
    world.join("First");
    world.write(0);
    world.until_judged(1);
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
    assert_eq!(world.names_that_judged(0), ["First", "Scenes"]);
}

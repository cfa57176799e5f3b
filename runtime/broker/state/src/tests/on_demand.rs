//! Tests of on-demand checks: checks that clients request only for themselves.

use qcbus_formats::xqar::Level;
use qcbus_messages::control::Response;
use qcbus_messages::{Absence, DocumentRole, MissingDocument};
use qcbus_types::{ChildEnd, PrepareFailure, PreparedJob};

use super::*;

/// Returns a world in which clients can ask the child of a manifest, besides a bundle that joined by hand.
fn world_that_can_be_asked() -> World {
    let mut world = World::new();
    world.join("First");
    world.child_is_there();
    world
}

/// Returns the same world with a client that has asked for an unwatched file.
fn world_with_a_client() -> (World, RequestId) {
    let mut world = world_that_can_be_asked();
    world.write(8);
    let request_id = world.ask(8);
    (world, request_id)
}

/// Performs all pending work several times, so that on-demand checks end.
fn go_round(world: &mut World) {
    for n in 0..4 {
        world.prepare(n, true);
        world.answer(n);
        world.store(n, true);
        world.pool(n, true);
        world.tell_pooled();
    }
}

fn is_checked(world: &World, request_id: RequestId) -> bool {
    match world.clients.answers.get(&request_id) {
        Some(Response::Checked(_)) => true,
        Some(Response::Elsewhere { .. }) => false,
        other => panic!("expected an answer, found {other:?}"),
    }
}

fn is_open(world: &World, request_id: RequestId) -> bool {
    world.clients.open.contains_key(&request_id)
}

fn jobs_of(world: &World, name: &str) -> usize {
    let peers = world.peers.values().filter(|it| it.name == name);
    peers.map(|it| it.jobs.len()).sum()
}

#[test]
fn client_gets_findings_of_named_bundles_in_unwatched_file() {
    let (mut world, request_id) = world_with_a_client();
    world.prepare(0, true);
    assert_eq!(jobs_of(&world, CHILD), 1);
    assert_eq!(jobs_of(&world, "First"), 0, "this bundle is not requested");
    go_round(&mut world);
    assert!(is_checked(&world, request_id));
    world.clients_are_content();
    assert!(world.judged.is_empty() && world.journal.is_empty());
    assert!(world.watched.is_empty());
}

#[test]
fn watched_file_is_judged_despite_on_demand_check() {
    let mut world = world_that_can_be_asked();
    world.write(0);
    let request_id = world.ask(0);
    go_round(&mut world);
    assert!(is_checked(&world, request_id));
    assert_eq!(world.names_that_judged(0), [CHILD, "First"]);
    assert_eq!(world.stored.len(), 1);
}

#[test]
fn files_of_on_demand_checks_are_not_counted() {
    let (mut world, _) = world_with_a_client();
    world.write(0);
    world.ask(0);
    let files = world.state.status().files;
    assert_eq!((files.total, files.judged), (1, 0));
    world.settle();
    let files = world.state.status().files;
    assert_eq!((files.total, files.judged, files.accepted), (1, 1, 1));
}

#[test]
fn on_demand_check_with_unavailable_bundle_is_refused() {
    let joined_manually: fn(&mut World) -> RequestId = |world| world.ask_by(8, &[CHILD, "First"]);
    let unknown: fn(&mut World) -> RequestId = |world| world.ask_by(8, &["Nobody"]);
    let of_an_older_manifest: fn(&mut World) -> RequestId = |world| {
        world.manifest(Some(2));
        world.ask(8)
    };
    let without_a_manifest: fn(&mut World) -> RequestId = |world| {
        world.manifest(None);
        world.ask(8)
    };
    let broken: fn(&mut World) -> RequestId = |world| {
        let child = world.peers.values().position(|it| it.name == CHILD);
        world.kill(child.unwrap() as u8);
        world.pass(Duration::from_secs(1));
        world.child_ends(ChildEnd::NotStarted("no such program".to_owned()));
        world.ask(8)
    };
    let asks = [
        joined_manually,
        unknown,
        of_an_older_manifest,
        without_a_manifest,
        broken,
    ];
    for (number, asks) in asks.into_iter().enumerate() {
        let mut world = world_that_can_be_asked();
        world.write(8);
        let request_id = asks(&mut world);
        assert!(!is_open(&world, request_id), "{number}: answered at once");
        assert!(!is_checked(&world, request_id), "{number}");
        world.clients_are_content();
    }
}

#[test]
fn on_demand_check_of_unsuitable_file_is_refused() {
    let mut world = world_that_can_be_asked();
    let part = world.ask(10);
    assert!(!is_checked(&world, part));
    let missing = world.ask(8);
    assert!(is_open(&world, missing));
    world.prepare(0, true);
    assert!(!is_checked(&world, missing));
    world.clients_are_content();
}

#[test]
fn file_changed_during_on_demand_check_is_checked_again() {
    let (mut world, request_id) = world_with_a_client();
    world.prepare(0, true);
    world.write(8);
    world.write(10);
    while !world.preparing.is_empty() || is_open(&world, request_id) {
        go_round(&mut world);
    }
    assert!(is_checked(&world, request_id));
}

#[test]
fn unreadable_file_is_left_to_client_to_read() {
    let failures = [
        PrepareFailure::Unreadable("no right".to_owned()),
        PrepareFailure::Moment("too many open files".to_owned()),
        PrepareFailure::NoRoom("full".to_owned()),
        PrepareFailure::Busy,
    ];
    for failure in failures {
        let (mut world, request_id) = world_with_a_client();
        let limit = world.state.settings.room_limit + Duration::from_secs(60);
        while is_open(&world, request_id) {
            assert!(world.now < limit, "{failure:?}");
            match world.preparing.pop() {
                Some((job, _)) => world.event(Event::Prepared {
                    job,
                    result: Err(failure.clone()),
                }),
                None => world.pass(Duration::from_millis(50)),
            }
        }
        assert!(!is_checked(&world, request_id), "{failure:?}");
        world.clients_are_content();
    }
}

#[test]
fn missing_document_of_on_demand_check_fails_it() {
    let (mut world, request_id) = world_with_a_client();
    let (job, file) = world.preparing.remove(0);
    let inputs = world.inputs(file);
    let result = Ok(Box::new(PreparedJob {
        basis: basis(&inputs),
        inputs,
        racy: false,
        documents: Vec::new(),
        missing: vec![MissingDocument {
            role: DocumentRole::Map,
            reference: "map.xodr".to_owned(),
            path: "/private/map.xodr".to_owned(),
            why: Absence::Unreadable {
                why: "no right".to_owned(),
            },
            level: Level::Warning,
            referred_at: 0,
            within: None,
        }],
        rests_on: Vec::new(),
        unwatched: Vec::new(),
        bytes: 1,
    }));
    world.event(Event::Prepared { job, result });
    world.answer(1);
    assert!(world.clients.pooling.is_empty());
    assert!(!is_checked(&world, request_id));
}

#[test]
fn bundle_crash_fails_only_its_on_demand_check() {
    let (mut world, request_id) = world_with_a_client();
    let waits = world.ask(8);
    world.prepare(0, true);
    world.kill(1);
    assert!(!is_checked(&world, request_id));
    assert!(is_open(&world, waits), "the bundle did not have this job");
    world.settle();
    assert!(is_checked(&world, waits));
}

#[test]
fn on_demand_check_fails_if_bundle_does_not_return() {
    let (mut world, request_id) = world_with_a_client();
    world.kill(1);
    world.prepare(0, true);
    world.pass(Duration::from_secs(1));
    assert!(is_open(&world, request_id), "the bundle may still return");
    world.child_ends(ChildEnd::NotStarted("no such program".to_owned()));
    assert!(!is_checked(&world, request_id));
    world.clients_are_content();
}

#[test]
fn on_demand_check_fails_if_bundle_changed_before_pooling() {
    let (mut world, request_id) = world_with_a_client();
    world.prepare(0, true);
    world.answer(1);
    world.pool(0, true);
    world.manifest(Some(2));
    world.tell_pooled();
    assert!(!is_checked(&world, request_id));
    world.settle();
    world.clients_are_content();
}

#[test]
fn on_demand_findings_are_kept_when_others_join() {
    let (mut world, request_id) = world_with_a_client();
    world.prepare(0, true);
    world.answer(1);
    world.join("Second");
    world.pool(0, true);
    world.tell_pooled();
    assert!(
        is_open(&world, request_id),
        "the result belongs to an older epoch"
    );
    assert_eq!(jobs_of(&world, CHILD), 0, "no bundle is asked twice");
    world.pool(0, true);
    world.tell_pooled();
    assert!(is_checked(&world, request_id));
}

#[test]
fn on_demand_check_fails_under_new_configuration() {
    for rounds in 0..3 {
        let (mut world, request_id) = world_with_a_client();
        if rounds > 0 {
            world.prepare(0, true);
        }
        if rounds > 1 {
            world.answer(1);
        }
        world.step(&Step::Reconfigure(1));
        assert!(!is_checked(&world, request_id));
        world.settle();
        world.clients_are_content();
    }
}

#[test]
fn on_demand_check_of_disconnected_client_is_cancelled() {
    // The client leaves while its file waits, is read, is checked, or is pooled.
    for rounds in 0..4 {
        let mut world = world_that_can_be_asked();
        world.write(8);
        world.state.settings.max_preparing = rounds.min(1);
        world.ask(8);
        if rounds > 1 {
            world.prepare(0, true);
        }
        if rounds > 2 {
            world.answer(1);
        }
        world.client_leaves(0);
        world.prepare(0, true);
        assert_eq!(jobs_of(&world, CHILD), 0, "{rounds}");
        world.pool(0, true);
        world.tell_pooled();
        assert!(world.state.jobs.is_empty(), "{rounds}");
        world.clients_are_content();
    }
}

#[test]
fn draining_broker_finishes_on_demand_checks_and_begins_none() {
    let (mut world, begun) = world_with_a_client();
    world.prepare(0, true);
    world.state.settings.max_preparing = 0;
    let waits = world.ask(8);
    world.event(Event::Drain);
    assert!(!is_checked(&world, waits));
    let late = world.ask(8);
    assert!(!is_checked(&world, late));
    world.answer(1);
    world.pool(0, true);
    world.tell_pooled();
    assert!(is_checked(&world, begun));
    world.drain();
}

#[test]
fn on_demand_client_is_answered_when_broker_cannot_finish() {
    let (mut world, request_id) = world_with_a_client();
    world.state.settings.job_deadline = Duration::from_secs(1000);
    world.state.settings.silence_limit = Duration::from_secs(1000);
    world.prepare(0, true);
    world.event(Event::Drain);
    world.pass(world.state.settings.drain_limit + Duration::from_millis(1));
    world.pass(Duration::from_secs(4));
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
    assert!(!is_checked(&world, request_id));
    world.clients_are_content();
}

/// Returns a world in which clients ask again after each answer. There are more clients than the
/// child takes at a time.
fn world_of_busy_clients() -> World {
    let mut world = world_that_can_be_asked();
    for file in [8, 9] {
        world.write(file);
    }
    for _ in 0..4 {
        world.ask(8);
    }
    world
}

/// Performs all work that is possible at once. Then the child ends one job.
fn keep_asking(world: &mut World) {
    for _ in 0..8 {
        world.prepare(0, true);
        world.pool(0, true);
        world.tell_pooled();
        if world.clients.open.len() < 4 {
            world.ask(8);
        }
    }
    world.answer(0);
    world.answer(1);
}

#[test]
fn watched_file_is_judged_despite_many_on_demand_checks() {
    let mut world = world_of_busy_clients();
    for bundle in world.state.bundles.values_mut() {
        bundle.capacity = 1;
    }
    world.write(0);
    for _ in 0..20 {
        keep_asking(&mut world);
        world.store(0, true);
        if !world.judged.is_empty() {
            return;
        }
    }
    panic!("the file must be judged");
}

#[test]
fn no_client_waits_forever_behind_later_ones() {
    let mut world = world_of_busy_clients();
    world.state.bundles.get_mut(CHILD).unwrap().capacity = 1;
    let first: Vec<RequestId> = world.clients.open.keys().copied().collect();
    for _ in 0..20 {
        keep_asking(&mut world);
    }
    assert!(first.iter().all(|it| !is_open(&world, *it)), "{first:?}");
}

//! Bundles that change all the time: they are accepted less and less often, and no file starves.

use qcbus_messages::{Catalogue, Hello};

use super::*;

const SECOND: Duration = Duration::from_secs(1);

fn changed(number: u64) -> FromPeer {
    let catalogue = Catalogue {
        build_date: number.to_string(),
        ..catalogue("First")
    };
    FromPeer::Catalogue(Box::new(catalogue))
}

/// Creates a world with two bundles. The first one may change three times.
fn world() -> (World, SessionId) {
    let mut world = World::new();
    world.state.settings.changes_forgiven = 4;
    world.join("First");
    world.join("Second");
    let first = world.peers.iter().find(|(_, it)| it.name == "First");
    let session = *first.unwrap().0;
    (world, session)
}

/// Lets time pass in small steps, as the engine does, and calls `each` at every step. No bundle answers.
fn over(world: &mut World, time: Duration, step: Duration, mut each: impl FnMut(&mut World)) {
    let end = world.now + time;
    while world.now < end {
        world.now += step;
        each(world);
        let actions = world.state.handle(world.now, Event::Tick);
        assert!(!actions.iter().any(|it| matches!(it, Action::Kill { .. })));
    }
}

fn say(world: &mut World, session: SessionId, message: FromPeer) {
    let _ = world
        .state
        .handle(world.now, Event::Message { session, message });
}

#[test]
fn flapping_bundle_is_accepted_less_often_and_reported() {
    let (mut world, session) = world();
    let before = world.state.epoch().0;
    let mut number = 0;
    over(&mut world, 600 * SECOND, SECOND / 10, |world| {
        number += 1;
        say(world, session, changed(number));
    });
    let epochs = world.state.epoch().0 - before;
    // Three changes are accepted at once, the others after pauses of 2, 4, 8 … 256 s.
    assert_eq!(epochs, 3 + 8, "of 6,000 changes");
    let flapping = |it: &&(Notice, Duration)| it.0.kind() == "flapping";
    assert!(world.state.notices.iter().filter(flapping).count() >= 8);
    let status = world.state.status();
    let first = status.peers.iter().find(|it| it.name == "First").unwrap();
    assert!(
        first.note.contains("next change is accepted in"),
        "{}",
        first.note
    );
}

#[test]
fn flapping_bundle_delays_no_job_but_prevents_acceptance() {
    let (mut world, session) = world();
    for number in 0..4 {
        say(&mut world, session, changed(number));
    }
    assert!(!world.state.bundles["First"].ready);
    world.write(0);
    world.prepare(0, true);
    let second = world.peers.iter().find(|(_, it)| it.name == "Second");
    let second = *second.unwrap().0;
    let job = *world.peers[&second].jobs.first().unwrap();
    assert!(world.peers[&session].jobs.is_empty());
    world.say(second, FromPeer::JobDone { job, micros: 1 });
    let finished = world
        .storing
        .first()
        .expect("the result must not wait for the flapping bundle");
    let first = finished.bundles.iter().find(|it| it.name == "First");
    let why = first.unwrap().failure.clone().unwrap();
    assert!(why.contains("gets no tasks for now"), "{why}");
}

#[test]
fn flapping_bundle_loses_its_jobs_until_accepted_again() {
    let (mut world, session) = world();
    for number in 0..3 {
        say(&mut world, session, changed(number));
    }
    world.write(0);
    world.prepare(0, true);
    assert_eq!(world.peers[&session].jobs.len(), 1);
    let job = *world.peers[&session].jobs.first().unwrap();
    say(&mut world, session, changed(9));
    say(&mut world, session, FromPeer::JobDone { job, micros: 1 });
    let task = &world.state.jobs[&job].tasks["First"];
    assert!(task.missing, "an answer from a changed bundle is ignored");
    over(&mut world, 3 * SECOND, SECOND, |_| {});
    let first = &world.state.bundles["First"];
    let is_it = first.catalogue.as_ref().unwrap().build_date == "9";
    assert_eq!((first.ready, first.note.as_str(), is_it), (true, "", true));
}

#[test]
fn new_session_does_not_bypass_flapping_pause() {
    let (mut world, session) = world();
    for number in 0..4 {
        say(&mut world, session, changed(number));
    }
    let pid = world.state.bundles["First"].pid;
    // The bundle returns to its last accepted registration.
    say(&mut world, session, changed(2));
    assert!(!world.state.bundles["First"].ready);
    for number in 10..30_u64 {
        let session = SessionId(1000 + number);
        let hello = Hello {
            pid,
            version: number.to_string(),
            ..hello(session, "First", 1, None)
        };
        let event = Event::Hello { session, hello };
        let _ = world.state.handle(world.now, event);
        say(&mut world, session, changed(number));
        assert!(!world.state.bundles["First"].ready, "{number}");
        say(&mut world, session, FromPeer::Leaving);
    }
}

#[test]
fn repeated_registration_is_no_change() {
    let (mut world, session) = world();
    say(&mut world, session, changed(1));
    let epoch = world.state.epoch();
    for _ in 0..100 {
        say(&mut world, session, changed(1));
    }
    assert_eq!(world.state.epoch(), epoch);
    assert!(world.state.bundles["First"].ready);
}

#[test]
fn long_stable_bundle_is_accepted_at_once() {
    let (mut world, session) = world();
    for number in 0..4 {
        say(&mut world, session, changed(number));
    }
    over(&mut world, 700 * SECOND, SECOND, |_| {});
    for number in 10..13 {
        say(&mut world, session, changed(number));
        assert!(world.state.bundles["First"].ready);
    }
}

#[test]
fn endless_new_names_are_accepted_less_often() {
    let mut world = World::new();
    world.state.settings.changes_forgiven = 2;
    let before = world.state.epoch().0;
    let mut number = 0;
    over(&mut world, 60 * SECOND, SECOND / 10, |world| {
        number += 1;
        let session = SessionId(1000 + number);
        let hello = hello(session, &format!("New{number}"), 1, None);
        let event = Event::Hello { session, hello };
        let _ = world.state.handle(world.now, event);
        say(world, session, changed(number));
        say(world, session, FromPeer::Leaving);
    });
    // A bundle that is not accepted is not in the registry. Therefore its end changes nothing.
    let epochs = world.state.epoch().0 - before;
    assert!(
        epochs < 100,
        "too many epochs for 600 new bundles: {epochs}"
    );
}

#[derive(Debug, Clone)]
enum Whim {
    Say(u64),
    Pass(u64),
    Rejoin,
}

proptest! {
    /// The required pauses lie between accepted changes, regardless of the bundle's behaviour.
    #[test]
    fn accepted_changes_keep_the_required_pauses(
        whims in prop::collection::vec(
            prop_oneof![
                4 => (0..5_u64).prop_map(Whim::Say),
                2 => (1..5000_u64).prop_map(Whim::Pass),
                1 => Just(Whim::Rejoin),
            ],
            1..200,
        ),
    ) {
        let (mut world, mut session) = world();
        let mut epoch = world.state.epoch();
        let mut accepted_spec = vec![world.now];
        for (number, whim) in (0..).zip(whims) {
            match whim {
                Whim::Say(number) => say(&mut world, session, changed(number)),
                Whim::Pass(millis) => {
                    world.now += Duration::from_millis(millis);
                    let _ = world.state.handle(world.now, Event::Tick);
                }
                Whim::Rejoin => {
                    session = SessionId(1000 + number);
                    let pid = world.state.bundles["First"].pid;
                    let hello = Hello { pid, ..hello(session, "First", 1, None) };
                    let _ = world.state.handle(world.now, Event::Hello { session, hello });
                }
            }
            if std::mem::replace(&mut epoch, world.state.epoch()) != world.state.epoch() {
                accepted_spec.push(world.now);
            }
        }
        let settings = &world.state.settings;
        for (beyond, pair) in accepted_spec.windows(2).skip(3).enumerate() {
            let due = settings.distrust.saturating_mul(1 << beyond.min(20));
            let due = due.min(settings.distrust_max);
            prop_assert!(pair[1] - pair[0] >= due, "{accepted_spec:?}");
        }
    }
}

//! Tests of children: files while a child cannot be started, and failed upgrades.

use qcbus_types::{ChildEnd, ChildSpec, Restart, Until};

use super::*;

pub fn notices(world: &World) -> Vec<&'static str> {
    world
        .state
        .notices
        .iter()
        .map(|(it, _)| it.kind())
        .collect()
}

/// Returns a world with a manifest, whose child runs as version 1.
fn world_with_a_child() -> World {
    let mut world = World::new();
    world.manifest(Some(1));
    world.pass(Duration::ZERO);
    world.child_joins();
    world
}

/// Returns a world in which the child runs as version 1 and a manifest of version 2 has arrived.
fn world_with_an_upgrade() -> World {
    let mut world = world_with_a_child();
    world.write(0);
    world.settle();
    world.manifest(Some(2));
    assert_eq!(world.launched.len(), 1, "the newer version is started");
    world
}

fn child_version(world: &World) -> &str {
    &world.state.bundles[CHILD].version
}

#[test]
fn upgrade_takes_over_and_old_process_leaves() {
    let mut world = world_with_an_upgrade();
    world.child_joins();
    assert_eq!(child_version(&world), "2");
    let old = world.peers.values().find(|it| it.drained);
    assert_eq!(old.unwrap().name, CHILD);
    world.settle();
    assert!(world.peers.values().all(|it| !it.drained));
}

#[test]
fn bundle_started_by_other_command_judges_anew() {
    let mut world = world_with_a_child();
    world.write(0);
    world.settle();
    let stored = world.stored.len();
    let specs = vec![ChildSpec {
        command: vec!["child".to_owned(), "--strict".to_owned()],
        ..child(1)
    }];
    world.event(Event::Children { specs });
    world.child_joins();
    let waits = Event::Wait {
        request_id: RequestId(9),
        path: path_of(0),
        stamp: Some(stamp(world.there[&path_of(0)])),
        unwatched: None,
        until: Until::default(),
    };
    let answered = |it: &Action| matches!(it, Action::Answer { .. });
    assert!(!world.state.handle(world.now, waits).iter().any(answered));
    assert_eq!(world.preparing.len(), 1, "the file is judged again");
    assert_eq!(world.stored.len(), stored);
}

#[test]
fn slow_starting_child_may_join_later() {
    for (slow_start, patient) in [(false, false), (true, true)] {
        let mut world = World::new();
        let spec = ChildSpec {
            slow_start,
            ..child(1)
        };
        world.event(Event::Children { specs: vec![spec] });
        world.pass(Duration::ZERO);
        let launch = world.launched[0].launch;
        world.pass(Duration::from_secs(16));
        assert_eq!(!world.killed.contains(&launch), patient);
        world.pass(Duration::from_secs(110));
        assert!(world.killed.contains(&launch), "killed after the limit");
    }
}

#[test]
fn child_replaced_by_newer_manifest_before_joining_is_killed() {
    let first_start = || {
        let mut world = World::new();
        world.manifest(Some(1));
        world.pass(Duration::ZERO);
        world
    };
    // Its earlier messages may be lost, or arrive before or after its end is known.
    for late in [None, Some(false), Some(true)] {
        for mut world in [first_start(), world_with_an_upgrade()] {
            let old = world.launched[0].launch;
            world.manifest(Some(3));
            world.pass(Duration::ZERO);
            assert!(
                world.killed.contains(&old),
                "the process is no longer wanted"
            );
            if let Some(known) = late {
                world.child_joins_too_late(known);
            }
            world.settle();
            assert_eq!(child_version(&world), "3", "{late:?}");
        }
    }
}

#[test]
fn upgrade_that_dies_before_joining_is_retried() {
    let mut world = world_with_an_upgrade();
    world.child_ends(ChildEnd::Failed("it crashed".to_owned()));
    assert!(notices(&world).contains(&"not-upgraded"));
    assert_eq!(child_version(&world), "1", "the older version continues");
    world.pass(Duration::from_millis(1));
    assert!(world.launched.is_empty(), "not restarted without a pause");
    world.pass(Duration::from_secs(1));
    assert_eq!(world.launched.len(), 1, "the upgrade is started again");
    world.child_joins();
    assert_eq!(child_version(&world), "2");
}

#[test]
fn repeated_upgrade_failures_lengthen_the_pauses() {
    let mut world = world_with_an_upgrade();
    let mut pauses = Vec::new();
    for _ in 0..3 {
        world.child_ends(ChildEnd::Failed("it crashed".to_owned()));
        let mut pause = Duration::ZERO;
        while world.launched.is_empty() {
            world.pass(Duration::from_millis(50));
            pause += Duration::from_millis(50);
        }
        pauses.push(pause);
    }
    assert!(
        pauses.is_sorted() && pauses[0] * 3 < pauses[2],
        "{pauses:?}"
    );
}

#[test]
fn hanging_upgrade_is_killed_and_retried() {
    let mut world = world_with_an_upgrade();
    let launch = world.launched[0].launch;
    world.pass(Duration::from_secs(16));
    assert!(world.killed.contains(&launch), "{:?}", world.killed);
    assert!(notices(&world).contains(&"not-upgraded"));
    world.pass(Duration::from_secs(60));
    world.child_joins();
    assert_eq!(child_version(&world), "2");
}

#[test]
fn file_is_undetermined_at_once_if_child_cannot_start() {
    let ends = [
        (1, ChildEnd::NotStarted("no such program".to_owned())),
        (1, ChildEnd::Done("it ended with exit code 0".to_owned())),
        (3, ChildEnd::Failed("it ended with exit code 1".to_owned())),
    ];
    for (times, end) in ends {
        let mut world = World::new();
        world.join("First");
        world.manifest(Some(1));
        world.write(0);
        world.prepare(0, true);
        for _ in 0..times {
            world.pass(Duration::from_millis(900));
            world.child_ends(end.clone());
        }
        world.answer(0);
        world.store(0, true);
        let (_, verdict) = &world.judged[&0];
        assert_eq!(*verdict, Verdict::Undetermined, "{end:?}");
        assert!(world.now < world.state.settings.absence_limit);
        // No work is repeated while the child stays away.
        let stored = world.stored.len();
        for _ in 0..10 {
            world.pass(Duration::from_secs(1));
            world.prepare(0, true);
            world.answer(0);
            world.store(0, true);
        }
        assert_eq!(world.stored.len(), stored, "{end:?}");
    }
}

#[test]
fn child_that_never_joins_is_awaited_once() {
    let mut world = World::new();
    world.join("First");
    world.manifest(Some(1));
    world.write(0);
    world.prepare(0, true);
    world.answer(0);
    world.store(0, true);
    assert!(world.judged.is_empty(), "the child may still join");
    world.pass(Duration::from_secs(16));
    world.answer(0);
    world.store(0, true);
    assert_eq!(world.judged[&0].1, Verdict::Undetermined);
    let why = &world.failures[&0][0];
    assert!(
        !why.contains("bundle remove"),
        "the bundle has a manifest: {why}"
    );
    // A child that joins late still judges.
    world.pass(Duration::from_secs(60));
    world.child_joins();
    world.settle();
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
}

/// Checks the time limit of a child with a slow start. A module of ASAM's framework runs over
/// samples before it joins, which takes long on a busy machine.
#[test]
fn slow_starting_child_is_awaited_up_to_its_limit() {
    let starting = || {
        let mut world = World::new();
        world.join("First");
        world.manifest(Some(1));
        let child = world.state.children.get_mut(CHILD).unwrap();
        child.spec.slow_start = true;
        world.write(0);
        world.prepare(0, true);
        world.answer(0);
        world.store(0, true);
        world.pass(Duration::from_secs(100));
        world.answer(0);
        world.store(0, true);
        assert!(world.judged.is_empty(), "the child may still join");
        world
    };
    let mut world = starting();
    world.child_joins();
    world.settle();
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
    let mut world = starting();
    world.pass(Duration::from_secs(25));
    world.answer(0);
    world.store(0, true);
    assert_eq!(world.judged[&0].1, Verdict::Undetermined);
}

#[test]
fn manually_joined_bundle_stays_required_after_restart() {
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    world.restart();
    world.join("First");
    world.write(0);
    world.prepare(0, true);
    world.answer(0);
    world.store(0, true);
    assert!(world.judged.is_empty(), "the second bundle is waited for");
    world.pass(Duration::from_secs(25));
    world.store(0, true);
    assert_eq!(world.judged[&0].1, Verdict::Undetermined);
    let why = &world.failures[&0][0];
    assert!(why.contains("qcbus bundle remove Second"), "{why}");
    assert!(why.contains("since the broker was started"), "{why}");
    world.remove("Second");
    for _ in 0..4 {
        world.prepare(0, true);
        world.answer(0);
        world.store(0, true);
    }
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
}

#[test]
fn manifest_changed_without_broker_takes_effect() {
    let other_command = ChildSpec {
        command: vec!["other".to_owned()],
        ..child(2)
    };
    // Each case has the spec of the started child, its reported version, and whether it is the wanted one.
    let cases = [
        (child(1), 1, false),
        (child(2), 1, false),
        (other_command, 2, false),
        (child(2), 2, true),
    ];
    for (spec, version, wanted) in cases {
        let mut world = world_with_a_child();
        world.write(0);
        world.settle();
        world.manifest = None;
        world.restart();
        world.manifest(Some(2));
        // The process of the former broker has outlived it and joins the next one.
        world.stale_child_joins(version, &spec);
        assert_eq!(child_version(&world), version.to_string());
        let adopted = world.state.bundles[CHILD].pid;
        world.pass(Duration::from_secs(1));
        world.child_joins();
        world.pass(Duration::from_secs(1));
        assert_eq!(child_version(&world), "2");
        let stays = world.state.bundles[CHILD].pid == adopted;
        assert_eq!(stays, wanted, "{spec:?}");
    }
}

#[test]
fn restart_keeps_standing_verdicts() {
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    world.manifest(Some(1));
    world.pass(Duration::ZERO);
    world.child_joins();
    world.write(0);
    world.write(1);
    world.settle();
    let (stored, members) = (world.stored.len(), world.members.clone());
    world.restart();
    world.members.clear();
    world.settle();
    assert_eq!(world.stored.len(), stored);
    assert!(
        world.members.is_empty(),
        "the journal already has these required bundles"
    );
    world.members = members;
}

#[test]
fn checkers_of_missing_bundle_are_in_result() {
    let mut world = World::new();
    world.versions.insert("Second", 3);
    world.join("Second");
    world.restart();
    world.write(0);
    world.prepare(0, true);
    world.pass(world.state.settings.absence_limit);
    let said = &world.storing[0].bundles[0].said();
    assert_eq!((said.name.as_str(), said.version.as_str()), ("Second", "3"));
    assert_eq!(said.checkers.len(), 2);
}

#[test]
fn child_without_manifest_after_restart_is_not_required() {
    let mut world = world_with_an_upgrade();
    world.child_joins();
    world.settle();
    world.manifest = None;
    world.demanded.remove(CHILD);
    world.restart();
    assert!(!world.members.contains_key(CHILD));
    world.settle();
    assert_eq!(world.names_that_judged(0), ["First", "Second"]);
}

#[test]
fn child_wanted_again_before_leaving_is_replaced() {
    let mut world = world_with_a_child();
    world.manifest(None);
    world.manifest(Some(1));
    world.child_joins();
    let there = world.peers.values().filter(|it| it.name == CHILD);
    let drained: Vec<bool> = there.map(|it| it.drained).collect();
    assert_eq!(
        drained,
        [true, false],
        "the older process is drained, the newer one is connected"
    );
    world.leave(0);
    world.settle();
    assert_eq!(world.members[CHILD].version, "1");
}

#[test]
fn replaced_process_that_does_not_leave_is_killed() {
    let mut world = world_with_an_upgrade();
    let old = world.state.bundles[CHILD].launch.unwrap();
    world.child_joins();
    world.pass(Duration::from_secs(10));
    assert!(
        !world.killed.contains(&old),
        "the old process may still finish"
    );
    world.pass(Duration::from_millis(1));
    assert!(world.killed.contains(&old));
}

/// Returns a world with a child that has this restart policy and is being started.
pub fn world_that_starts(restart: Restart) -> World {
    let mut world = World::new();
    let specs = vec![ChildSpec {
        restart,
        ..child(1)
    }];
    world.manifest = Some(1);
    world.event(Event::Children { specs });
    world.pass(Duration::ZERO);
    assert_eq!(world.launched.len(), 1);
    world
}

/// Returns the same world after the child has joined.
fn world_with(restart: Restart) -> World {
    let mut world = world_that_starts(restart);
    world.child_joins();
    world
}

#[test]
fn child_is_restarted_according_to_manifest() {
    let leaves: fn(&mut World) = |world| world.leave(0);
    let dies: fn(&mut World) = |world| world.kill(0);
    let cases = [
        (Restart::Always, leaves, true),
        (Restart::Always, dies, true),
        (Restart::OnFailure, leaves, false),
        (Restart::OnFailure, dies, true),
        (Restart::Never, leaves, false),
        (Restart::Never, dies, false),
    ];
    for (number, (restart, ends, again)) in cases.into_iter().enumerate() {
        let mut world = world_with(restart);
        ends(&mut world);
        world.pass(Duration::from_secs(2));
        assert_eq!(!world.launched.is_empty(), again, "case {number}");
    }
    let mut world = world_with(Restart::Always);
    world.event(Event::Drain);
    world.leave(0);
    world.pass(Duration::from_secs(2));
    assert!(
        world.launched.is_empty(),
        "nothing is restarted while the broker stops"
    );
}

#[test]
fn restart_pauses_double_up_to_limit() {
    let mut world = World::new();
    world.manifest(Some(1));
    world.pass(Duration::ZERO);
    let mut pauses = Vec::new();
    for _ in 0..12 {
        world.child_ends(ChildEnd::Failed("it crashed".to_owned()));
        let ended = world.now;
        while world.launched.is_empty() {
            world.pass(Duration::from_millis(10));
        }
        pauses.push(world.now - ended);
    }
    let (first, most) = (
        world.state.settings.backoff,
        world.state.settings.backoff_max,
    );
    for (number, pause) in (0_u32..).zip(pauses) {
        let least = (first * 2_u32.pow(number)).min(most);
        // The pause has up to a quarter more, so that children that died together do not restart together.
        let tick = Duration::from_millis(20);
        assert!(
            least <= pause && pause <= least.mul_f64(1.25) + tick,
            "{number}: {pause:?}"
        );
    }
}

#[test]
fn child_that_fails_occasionally_is_not_given_up() {
    let mut world = World::new();
    world.state.settings.max_restarts = 2;
    world.manifest(Some(1));
    world.pass(Duration::ZERO);
    let window = world.state.settings.restart_window;
    for _ in 0..5 {
        world.child_ends(ChildEnd::Failed("it crashed".to_owned()));
        world.pass(window + Duration::from_secs(1));
    }
    assert!(
        !notices(&world).contains(&"gave-up"),
        "{:?}",
        notices(&world)
    );
    for _ in 0..5 {
        world.child_ends(ChildEnd::Failed("it crashed".to_owned()));
        world.pass(Duration::from_secs(5));
    }
    assert!(
        notices(&world).contains(&"gave-up"),
        "{:?}",
        notices(&world)
    );
}

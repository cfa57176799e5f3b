//! Tests of the end of a child's process.

use qcbus_types::{ChildEnd, Restart};

use super::children::{notices, world_that_starts};
use super::*;

fn crashed() -> ChildEnd {
    ChildEnd::Failed("it crashed".to_owned())
}

fn done() -> ChildEnd {
    ChildEnd::Done("it ended with exit code 0".to_owned())
}

/// Returns the time until the child is restarted.
fn pause(world: &mut World) -> Duration {
    let start = world.now;
    while world.launched.is_empty() {
        assert!(world.now < start + Duration::from_secs(3600), "never");
        world.pass(Duration::from_millis(50));
    }
    world.now - start
}

#[test]
fn bundle_of_ended_process_is_missing_at_once() {
    let mut world = world_that_starts(Restart::Always);
    world.child_joins();
    let launch = world.state.bundles[CHILD].launch.unwrap();
    let other = Launch(launch.0 + 1);
    let end = crashed();
    world.event(Event::Exited { launch: other, end });
    assert!(
        world.state.bundles[CHILD].session.is_some(),
        "another process has ended"
    );
    let end = crashed();
    world.event(Event::Exited { launch, end });
    assert!(world.state.bundles[CHILD].session.is_none());
    assert!(world.peers.is_empty(), "its session is closed");
    assert_eq!(notices(&world), ["ended"]);
    assert!(pause(&mut world) < Duration::from_secs(1));
}

#[test]
fn child_without_work_restarts_late_unless_always_wanted() {
    let mut world = world_that_starts(Restart::OnFailure);
    world.child_ends(done());
    assert!(notices(&world).is_empty(), "a normal end is not a failure");
    assert!(pause(&mut world) >= world.state.settings.backoff_max);
    let mut world = world_that_starts(Restart::Always);
    world.child_ends(done());
    assert_eq!(notices(&world), ["ended"]);
    assert!(pause(&mut world) < Duration::from_secs(1));
}

#[test]
fn child_end_during_drain_gives_no_notice() {
    let mut world = world_that_starts(Restart::Always);
    world.event(Event::Drain);
    world.child_ends(crashed());
    assert!(notices(&world).is_empty());
}

#[test]
fn failing_child_is_awaited_twice() {
    let mut world = World::new();
    world.join("First");
    world.manifest(Some(1));
    pause(&mut world);
    world.write(0);
    world.prepare(0, true);
    for time in 1..=3 {
        world.child_ends(crashed());
        world.answer(0);
        world.store(0, true);
        assert_eq!(world.judged.contains_key(&0), time == 3, "failure {time}");
        pause(&mut world);
    }
    assert_eq!(world.judged[&0].1, Verdict::Undetermined);
}

#[test]
fn child_that_fails_repeatedly_pauses_for_window() {
    let mut world = world_that_starts(Restart::Always);
    world.state.settings.max_restarts = 3;
    world.state.settings.backoff_max = Duration::from_secs(1);
    let window = world.state.settings.restart_window;
    for _ in 0..3 {
        world.child_ends(crashed());
        assert!(pause(&mut world) < Duration::from_secs(3));
    }
    assert_eq!(world.state.children[CHILD].restarts, 3);
    world.child_ends(crashed());
    assert!(notices(&world).contains(&"gave-up"));
    let rest = pause(&mut world);
    let tick = Duration::from_millis(50);
    assert!((window..=window + tick).contains(&rest), "{rest:?}");
}

//! Tests of the end of a broker, and of the time at which it begins to judge.

use super::*;

#[test]
fn draining_broker_finishes_jobs_and_begins_none() {
    let mut world = World::at_work();
    world.event(Event::Drain);
    world.write(4);
    assert!(world.preparing.is_empty(), "no new job is started");
    assert_eq!(world.stopped, 0);
    world.answer(0);
    world.store(0, true);
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
    assert!(!world.judged.contains_key(&4));
}

#[test]
fn broker_that_cannot_finish_stops_after_drain_limit() {
    let mut world = World::at_work();
    world.state.settings.job_deadline = Duration::from_secs(1000);
    world.state.settings.silence_limit = Duration::from_secs(1000);
    world.event(Event::Drain);
    world.pass(world.state.settings.drain_limit);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 0);
    world.pass(Duration::from_millis(1));
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
}

/// Returns a world that ends when all files are judged, with two files that are judged one by one.
fn world_that_runs_once(scanned: bool) -> World {
    let mut world = World::new();
    world.join("First");
    world.state.settings.once = true;
    world.state.settings.max_active = 1;
    world.state.scanned = scanned;
    world.write(0);
    world.write(4);
    world
}

#[test]
fn run_stops_when_every_file_is_judged() {
    let mut world = world_that_runs_once(false);
    world.until_judged(2);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 0, "more files may be found");
    world.event(Event::Scanned);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
    let mut world = world_that_runs_once(true);
    for (judged, stopped) in [(1, 0), (2, 1)] {
        world.until_judged(judged);
        world.pass(Duration::ZERO);
        assert_eq!(world.stopped, stopped);
    }
}

#[test]
fn run_waits_for_file_that_must_pause() {
    let mut world = World::new();
    world.join("First");
    world.state.settings.once = true;
    world.write(0);
    world.prepare(0, false);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 0, "the file waits because there was no room");
    world.pass(world.state.settings.retry_after);
    world.until_judged(1);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
}

/// Returns a world with a process that the broker started. It was told to stop and has no work.
fn world_that_says_goodbye() -> (World, Launch) {
    let mut world = World::new();
    world.manifest(Some(1));
    world.pass(Duration::ZERO);
    world.child_joins();
    let launch = world.state.bundles[CHILD].launch.unwrap();
    world.event(Event::Drain);
    world.pass(Duration::ZERO);
    assert!(
        world.peers.values().all(|it| it.drained),
        "every process is drained"
    );
    assert_eq!(world.stopped, 0, "the process may still leave");
    (world, launch)
}

#[test]
fn stopping_broker_waits_until_its_children_left() {
    let (mut world, launch) = world_that_says_goodbye();
    world.pass(Duration::from_secs(1));
    assert_eq!(world.stopped, 0);
    world.leave(0);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
    assert!(!world.killed.contains(&launch));
}

#[test]
fn child_that_does_not_leave_on_stop_is_killed() {
    let (mut world, launch) = world_that_says_goodbye();
    world.pass(Duration::from_secs(3));
    assert!(!world.killed.contains(&launch));
    assert_eq!(world.stopped, 0);
    world.pass(Duration::from_millis(1));
    assert!(world.killed.contains(&launch));
    assert_eq!(world.stopped, 1);
}

#[test]
fn manually_started_bundle_stays_when_broker_stops() {
    let mut world = World::new();
    world.join("First");
    world.event(Event::Drain);
    world.pass(Duration::ZERO);
    assert_eq!(world.stopped, 1);
    assert!(world.peers.values().all(|it| !it.drained));
    assert!(world.killed.is_empty());
}

#[test]
fn nothing_is_read_before_bundles_had_time_to_join() {
    let mut world = World::new();
    world.state.judged_once = false;
    world.state.settings.collect = Duration::from_secs(1);
    world.join("First");
    world.write(0);
    world.pass(Duration::from_millis(999));
    assert!(
        world.preparing.is_empty(),
        "another bundle may still join manually"
    );
    world.manifest(Some(1));
    world.pass(Duration::from_millis(1));
    assert!(world.preparing.is_empty(), "a child is being started");
    world.child_joins();
    world.pass(Duration::ZERO);
    assert_eq!(world.preparing.len(), 1);
}

#[test]
fn newest_notices_are_kept() {
    let mut world = World::new();
    for number in 0..NOTICES + 10 {
        let notice = Notice::TurnedAway(number.to_string());
        world.state.notice(notice, &mut Vec::new());
    }
    assert_eq!(world.state.notices.len(), NOTICES);
    let newest = Notice::TurnedAway((NOTICES + 9).to_string());
    assert_eq!(world.state.notices.back().map(|(it, _)| it), Some(&newest));
}

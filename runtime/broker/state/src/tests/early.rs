//! Tests of a run that reads its files while its bundles start. No file is checked before all bundles are present.

use qcbus_types::PrepareFailure;

use super::*;

/// Returns a run on one file. Its only bundle has been started and has not joined.
fn run(once: bool) -> World {
    let mut world = World::new();
    world.state = fresh_state(1, 0);
    world.state.settings.once = once;
    world.manifest(Some(1));
    world.write(0);
    world.event(Event::Scanned);
    world.pass(Duration::ZERO);
    assert_eq!(world.launched.len(), 1);
    world
}

#[test]
fn files_are_read_before_bundles_join() {
    let mut world = run(true);
    assert_eq!(world.preparing.len(), 1, "the file is being read");
    world.prepare(0, true);
    assert!(
        world.storing.is_empty(),
        "no bundle has checked the file yet"
    );
    world.child_joins();
    let (session, job) = at_work(&world);
    assert!(
        world.peers.contains_key(&session),
        "{job:?} must be assigned"
    );
    world.until_judged(1);
    assert_eq!(world.names_that_judged(0), [CHILD]);
}

#[test]
fn file_changed_before_checking_is_read_again() {
    let mut world = run(true);
    world.prepare(0, true);
    world.write(0);
    world.child_joins();
    assert!(world.peers.values().all(|it| it.jobs.is_empty()));
    assert_eq!(world.preparing.len(), 1, "the new bytes are read");
    world.until_judged(1);
}

#[test]
fn unreadable_file_is_reported_once_all_bundles_joined() {
    let mut world = run(true);
    let (job, _) = world.preparing.remove(0);
    let result = Err(PrepareFailure::Unreadable("it is a directory".to_owned()));
    world.event(Event::Prepared { job, result });
    assert!(world.storing.is_empty());
    world.child_joins();
    let said = world.storing[0].unreadable.as_deref();
    assert_eq!(said, Some("it is a directory"));
}

#[test]
fn draining_run_does_not_wait_for_missing_bundles() {
    for read_before in [true, false] {
        let mut world = run(true);
        if read_before {
            world.prepare(0, true);
        }
        world.event(Event::Drain);
        world.prepare(0, true);
        world.pass(Duration::ZERO);
        assert_eq!(world.stopped, 1, "{read_before}");
        assert!(world.state.jobs.is_empty() && world.stored.is_empty());
    }
}

#[test]
fn watching_broker_reads_nothing_before_bundles_join() {
    let world = run(false);
    assert!(world.preparing.is_empty());
}

fn at_work(world: &World) -> (SessionId, JobId) {
    let busy = world.peers.iter().find_map(|(session, process)| {
        let job = process.jobs.first()?;
        Some((*session, *job))
    });
    busy.expect("a bundle has a job")
}

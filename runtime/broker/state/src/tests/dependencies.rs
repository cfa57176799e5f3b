//! Tests of files that a verdict depends on: they change, go, come back, and come late.

use qcbus_types::{FinishedJob, PrepareFailure, Reading, StoreOutcome};

use super::*;

/// Returns a world with a judged file and all its dependencies. `known` is the file whose verdict is examined.
fn world_with_dependencies(known: u8) -> World {
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    for file in [0, 4, 6, 7, known] {
        world.write(file);
    }
    world.settle();
    assert_eq!(world.judged[&known].0, world.inputs(known));
    world
}

#[test]
fn changed_dependency_has_its_file_judged_again() {
    for (file, part) in [(1, 0), (1, 6), (2, 6), (3, 4), (5, 7)] {
        let mut world = world_with_dependencies(file);
        // The dependency changes, is removed and comes back. Each step leads to a new verdict.
        let deeds: [fn(&mut World, u8); 3] = [World::write, World::delete, World::write];
        for deed in deeds {
            let before = world.stored.iter().filter(|it| **it == file).count();
            deed(&mut world, part);
            world.wait(file);
            assert_eq!(
                world.waiting.len(),
                1,
                "the client waits for the new verdict"
            );
            world.settle();
            assert_eq!(world.judged[&file].0, world.inputs(file));
            let after = world.stored.iter().filter(|it| **it == file).count();
            assert_eq!(after, before + 1, "{file} depends on {part}");
            assert!(world.waiting.is_empty());
        }
    }
}

#[test]
fn dependency_that_appears_later_has_its_file_judged_again() {
    let mut world = World::new();
    world.join("First");
    world.write(2);
    world.settle();
    assert_eq!(world.judged[&2].0[1].content, Reading::Absent);
    world.write(6);
    world.settle();
    assert_eq!(world.judged[&2].0, world.inputs(2));
}

#[test]
fn dependency_with_only_new_stamp_costs_no_new_verdict() {
    for touched in [5, 7, 4] {
        let mut world = world_with_dependencies(5);
        let before = world.stored.len();
        world.touch(touched);
        world.settle();
        assert_eq!(
            world.judged[&5].0,
            world.inputs(5),
            "the new stamp is recorded"
        );
        assert_eq!(world.stored.len(), before);
        // A repeated event with the same stamp causes no further reads.
        let stamp = stamp(world.there[&path_of(touched)]);
        let path = path_of(touched);
        world.event(Event::Settled { path, stamp });
        assert!(world.preparing.is_empty());
    }
}

#[test]
fn dependency_change_before_first_scan_is_not_forgotten() {
    let known = world_with_dependencies(2);
    let judged = known
        .state
        .files
        .get(known.state.files.id(&path_of(2)).unwrap());
    let judged = judged.unwrap().judged.clone().unwrap();
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    world.there.clone_from(&known.there);
    world.contents.clone_from(&known.contents);
    world.stamps = known.stamps;
    world.state.remember(&path_of(2), (*judged).clone(), &[]);
    world.write(6);
    let stamp = stamp(world.there[&path_of(2)]);
    let path = path_of(2);
    world.event(Event::Settled { path, stamp });
    world.settle();
    assert_eq!(world.judged[&2].0, world.inputs(2));
}

#[test]
fn file_that_vanishes_while_read_leaves_gate_at_once() {
    let mut world = judged_world();
    assert!(world.gate.contains_key(&1));
    world.step(&Step::Reconfigure(1));
    assert_eq!(world.preparing.len(), 1);
    world.delete(1);
    assert!(!world.gate.contains_key(&1));
    world.settle();
    assert!(!world.journal.contains_key(&1));
}

#[test]
fn file_found_changed_by_writer_is_read_again() {
    let mut world = judged_world();
    world.write(1);
    world.prepare(0, true);
    world.answer(0);
    world.answer(1);
    assert_eq!(world.storing.len(), 1);
    // The next change is not yet reported.
    world.stamps += 1;
    world.contents.insert(world.stamps, world.stamps);
    world.there.insert(path_of(1), world.stamps);
    world.store(0, true);
    assert_eq!(world.preparing.len(), 1);
}

#[test]
fn restored_file_is_published_again() {
    let mut world = judged_world();
    world.state.settings.max_active = 0;
    let (path, before) = (path_of(1), stamp(world.there[&path_of(1)]));
    let changed = stamp(1000);
    for (stamp, published) in [(changed, false), (before, false)] {
        let path = path.clone();
        world.event(Event::Settled { path, stamp });
        assert_eq!(world.gate.contains_key(&1), published);
    }
    world.state.settings.max_active = 4;
    world.pass(Duration::ZERO);
    assert!(world.preparing.is_empty(), "no file needs to be read");
    assert!(world.gate.contains_key(&1));
}

#[test]
fn file_being_written_at_first_scan_keeps_its_result() {
    let mut world = judged_world();
    world.restart_after(4, true);
    world.settle();
    let of_it = world.stored.iter().filter(|file| **file == 1);
    assert_eq!(of_it.count(), 1);
}

/// Writes a file again while it is being read, within the same clock tick.
fn written_again(world: &mut World) {
    let (path, stamp) = (path_of(0), stamp(world.there[&path_of(0)]));
    world.event(Event::Settled { path, stamp });
}

#[test]
fn young_file_rewritten_under_same_stamp_is_read_again() {
    for young in [true, false] {
        let mut world = World::new();
        world.young = young;
        world.join("First");
        world.write(0);
        written_again(&mut world);
        world.prepare(0, true);
        assert_eq!(
            world.preparing.len(),
            usize::from(young),
            "changed while the file is read"
        );
        world.prepare(0, true);
        written_again(&mut world);
        world.answer(0);
        world.store(0, true);
        assert_eq!(
            world.preparing.len(),
            usize::from(young),
            "changed while the file is checked"
        );
        world.settle();
    }
}

#[test]
fn unreadable_file_is_retried_and_reported_once() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    let not_read = |world: &mut World| {
        let (job, _) = world.preparing.remove(0);
        let result = Err(PrepareFailure::Unreadable("an old disk".to_owned()));
        world.event(Event::Prepared { job, result });
    };
    not_read(&mut world);
    let FinishedJob {
        job,
        required_set,
        config,
        epoch,
        ..
    } = world.storing.remove(0);
    let judged = Judged {
        job,
        verdict: Verdict::Undetermined,
        config,
        required_set,
        epoch,
        why: vec!["an old disk".to_owned()],
        ..unread()
    };
    world.journal.insert(0, judged.clone());
    let outcome = StoreOutcome::Stored(Box::new(judged));
    world.event(Event::Stored { job, outcome });
    world.pass(Duration::from_secs(61));
    not_read(&mut world);
    assert!(
        world.storing.is_empty(),
        "the same failure is not stored again"
    );
    world.pass(Duration::from_secs(61));
    world.settle();
    assert_eq!(world.judged[&0].1, Verdict::Accepted);
}

/// Returns the verdict on a file that could not be read.
fn unread() -> Judged {
    Judged {
        job: JobId(0),
        verdict: Verdict::Undetermined,
        own: Verdict::Undetermined,
        own_errors: 0,
        rests_on: Some(Vec::new()),
        digest: Digest::default(),
        basis: Digest::default(),
        config: Digest::default(),
        required_set: Arc::default(),
        epoch: Epoch::default(),
        inputs: Vec::new(),
        racy: true,
        counts: [0; 3],
        why: Vec::new(),
        xqar: None,
    }
}

/// Repeats an event with known content.
fn is_told_again(world: &mut World, file: u8) {
    let path = path_of(file);
    let stamp = stamp(world.there[&path]);
    world.event(Event::Settled { path, stamp });
}

/// Checks the reported age of a request. Data read from a map for one file may serve another only
/// if that one had already arrived.
#[test]
fn reader_gets_time_since_file_was_last_requested() {
    let second = Duration::from_secs(1);
    let deeds: [fn(&mut World, u8); 4] = [|_, _| {}, World::write, World::wait, is_told_again];
    for (deed, seconds) in deeds.into_iter().zip([3, 1, 1, 1]) {
        let mut world = World::new();
        world.join("First");
        world.state.settings.max_preparing = 1;
        world.write(0);
        world.write(3);
        world.pass(2 * second);
        deed(&mut world, 3);
        world.pass(second);
        assert_eq!(world.preparing.len(), 1, "only one file is read at a time");
        world.prepare(0, true);
        let (job, file) = world.preparing[0];
        assert_eq!(file, 3);
        assert_eq!(world.waited[&job], second * seconds);
    }
}

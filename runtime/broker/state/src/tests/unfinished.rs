//! Files that are still being written.

use qcbus_messages::control::Response;
use qcbus_types::StoreOutcome;

use super::words::{answers, comes_of, waits};
use super::*;

/// Gives file 1 another stamp while its writer is not finished.
fn write_slowly(world: &mut World) -> Vec<Action> {
    world.stamps += 1;
    let stamp = Some(stamp(world.stamps));
    let path = path_of(1);
    let actions = comes_of(world, Event::Unfinished { path, stamp });
    actions.iter().for_each(|it| world.gate_follows(it));
    actions
}

fn unpublishes(actions: &[Action], file: u8) -> bool {
    let path = path_of(file);
    let closes = |it: &Action| matches!(it, Action::CloseGate { path: closed } if *closed == path);
    actions.iter().any(closes)
}

#[test]
fn file_being_written_leaves_gate_and_has_no_verdict() {
    let mut world = judged_world();
    assert!(unpublishes(&write_slowly(&mut world), 1));
    assert!(!unpublishes(&write_slowly(&mut world), 1), "once");
    let asked = comes_of(&mut world, waits(1, None, None));
    assert!(answers(&asked).is_empty());
    assert!(world.preparing.is_empty(), "the file is not read");
}

#[test]
fn finished_file_is_judged_once() {
    let mut world = judged_world();
    write_slowly(&mut world);
    let before = world.stored.len();
    world.write(1);
    world.settle();
    assert_eq!(world.stored.len(), before + 1);
}

#[test]
fn file_opened_without_writing_keeps_its_verdict() {
    let mut world = judged_world();
    let (path, stamp) = (path_of(1), stamp(world.there[&path_of(1)]));
    assert!(world.state.is_settled(&path, stamp));
    let event = Event::Unfinished {
        path,
        stamp: Some(stamp),
    };
    assert!(!unpublishes(&comes_of(&mut world, event), 1));
    let asked = comes_of(&mut world, waits(1, None, Some(stamp)));
    assert!(matches!(answers(&asked)[..], [Response::Verdict(_)]));
}

#[test]
fn client_learns_that_unfinished_file_vanished() {
    let mut world = judged_world();
    let path = path_of(4);
    assert!(!world.state.is_settled(&path, stamp(1)));
    comes_of(&mut world, waits(4, None, None));
    let gone = comes_of(&mut world, Event::Vanished { path });
    assert!(matches!(answers(&gone)[..], [Response::Unwatched { .. }]));
}

/// Creates a world in which file 1 depends on file 0. Both have their verdicts.
fn two_judged() -> World {
    let mut world = judged_world();
    world.write(0);
    world.settle();
    world
}

fn asked_for_1(world: &mut World) -> Vec<Action> {
    let own = Some(stamp(world.there[&path_of(1)]));
    comes_of(world, waits(1, None, own))
}

#[test]
fn verdict_depending_on_unfinished_file_is_withheld() {
    let mut world = two_judged();
    let (path, slow) = (path_of(0), Some(stamp(world.stamps + 1)));
    world.event(Event::Unfinished { path, stamp: slow });
    assert!(answers(&asked_for_1(&mut world)).is_empty());
}

#[test]
fn verdict_stands_when_unfinished_file_is_restored() {
    let mut world = two_judged();
    let (before, stored) = (stamp(world.there[&path_of(0)]), world.stored.len());
    let (path, slow) = (path_of(0), Some(stamp(world.stamps + 1)));
    world.event(Event::Unfinished { path, stamp: slow });
    let (path, stamp) = (path_of(0), before);
    world.event(Event::Settled { path, stamp });
    world.settle();
    assert_eq!(world.stored.len(), stored, "no file is judged again");
    let asked = asked_for_1(&mut world);
    assert!(matches!(answers(&asked)[..], [Response::Verdict(_)]));
}

/// The earlier bytes may return after a result of the later ones was written, but not recorded.
#[test]
fn half_written_result_is_replaced_when_earlier_bytes_return() {
    for (half_written, again) in [(false, 0), (true, 1)] {
        let mut world = two_judged();
        let before = world.contents[&world.there[&path_of(0)]];
        world.write(0);
        while world.storing.is_empty() {
            world.pass(Duration::from_millis(50));
            world.prepare(0, true);
            (0..4).for_each(|peer| world.answer(peer));
        }
        let job = world.storing.remove(0).job;
        world.put(0, before);
        let outcome = StoreOutcome::Stale { half_written };
        world.event(Event::Stored { job, outcome });
        let stored = world.stored.iter().filter(|file| **file == 0).count();
        world.settle();
        let now = world.stored.iter().filter(|file| **file == 0).count();
        assert_eq!(now - stored, again, "half written: {half_written}");
    }
}

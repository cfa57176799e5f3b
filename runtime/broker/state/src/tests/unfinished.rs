//! Files that are still being written.

use qcbus_messages::control::Response;

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

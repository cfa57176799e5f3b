//! Results and published files that somebody else removes.

use super::*;

/// Somebody removes the result of file 1.
fn lose(world: &mut World) {
    let lost = vec![LostOutput {
        file: path_of(1),
        output: Path::new("/out/1.xodr.xqar").into(),
    }];
    world.event(Event::OutputsLost { lost });
}

#[test]
fn lost_result_is_written_again_though_no_byte_has_changed() {
    let mut world = judged_world();
    let before = world.stored.len();
    assert!(world.gate.contains_key(&1));
    lose(&mut world);
    assert!(!world.gate.contains_key(&1), "at once");
    world.settle();
    assert_eq!(world.stored.len(), before + 1);
    assert!(world.gate.contains_key(&1), "it is published again");
}

#[test]
fn result_that_is_lost_while_it_is_read_again_is_written() {
    let mut world = judged_world();
    let before = world.stored.len();
    world.step(&Step::Touch(1));
    lose(&mut world);
    world.settle();
    assert_eq!(world.stored.len(), before + 1, "not only confirmed");
}

#[test]
fn result_that_is_lost_before_its_verdict_is_told_is_written_once_more() {
    let mut world = World::new();
    world.join("First");
    world.write(1);
    world.prepare(0, true);
    world.answer(0);
    assert_eq!(world.storing.len(), 1);
    world.write_out(0, true);
    lose(&mut world);
    world.settle();
    assert_eq!(world.stored, [1, 1]);
}

#[test]
fn loss_of_a_file_that_has_gone_changes_nothing() {
    let mut world = judged_world();
    world.event(Event::Vanished { path: path_of(1) });
    world.settle();
    lose(&mut world);
    world.settle();
    assert_eq!(world.stored, [1]);
}

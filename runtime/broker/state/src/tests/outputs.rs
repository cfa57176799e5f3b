//! Tests of results and published files that another process removes.

use qcbus_types::LostOutput;

use super::membership::world_with_a_file_at_the_writers;
use super::*;

impl World {
    /// Removes the result of a file, if there is one.
    pub fn lose(&mut self, file: u8) {
        if !self.journal.contains_key(&file) {
            return;
        }
        self.lost.insert(file);
        let output = Path::new(&format!("/out/{file}.xqar")).into();
        let file = path_of(file);
        let lost = vec![LostOutput { file, output }];
        self.event(Event::OutputsLost { lost });
    }
}

#[test]
fn lost_result_is_written_again_without_changed_bytes() {
    let mut world = judged_world();
    let before = world.stored.len();
    assert!(world.gate.contains_key(&1));
    world.lose(1);
    assert!(!world.gate.contains_key(&1), "at once");
    world.settle();
    assert_eq!(world.stored.len(), before + 1);
    assert!(world.gate.contains_key(&1), "the file is published again");
}

#[test]
fn result_lost_during_rereading_is_written() {
    let mut world = judged_world();
    let before = world.stored.len();
    world.step(&Step::Touch(1));
    world.lose(1);
    world.settle();
    assert_eq!(
        world.stored.len(),
        before + 1,
        "written again and not only confirmed"
    );
}

#[test]
fn lost_result_of_file_touched_while_written_is_written() {
    let mut world = judged_world();
    world.lose(1);
    while world.storing.is_empty() {
        world.prepare(0, true);
        world.answer(0);
        world.pass(Duration::from_millis(300));
    }
    // The writer finds other stamps than were read, and no result is stored.
    world.step(&Step::Touch(1));
    world.store(0, true);
    world.settle();
    assert!(world.lost.is_empty());
}

#[test]
fn result_lost_before_verdict_is_written_again() {
    let mut world = world_with_a_file_at_the_writers();
    world.write_out(0, true);
    world.lose(1);
    world.settle();
    assert_eq!(world.stored, [1, 1]);
}

#[test]
fn lost_result_of_removed_file_changes_nothing() {
    let mut world = judged_world();
    world.event(Event::Vanished { path: path_of(1) });
    world.settle();
    world.lose(1);
    world.settle();
    assert_eq!(world.stored, [1]);
}

#[test]
fn accepted_file_missing_from_gate_is_published_at_start() {
    let mut world = judged_world();
    let before = world.stored.len();
    world.gate.remove(&1);
    world.restart();
    world.settle();
    assert_eq!(world.stored.len(), before, "no file is judged again");
    assert!(world.gate.contains_key(&1));
}

#[test]
fn file_missing_from_gate_waits_for_all_required_bundles() {
    let mut world = judged_world();
    world.gate.remove(&1);
    world.manifest = Some(1);
    world.restart();
    assert!(!world.gate.contains_key(&1));
    world.settle();
    assert!(world.gate.contains_key(&1));
}

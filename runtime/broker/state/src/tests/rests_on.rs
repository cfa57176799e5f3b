//! Verdicts that depend on the verdicts of other files.

use super::*;

/// Creates a world in which file 1 is a scenario on map 0, as far as the state machine can tell.
fn world() -> World {
    let mut world = World::new();
    world.join("First");
    world.join("Second");
    world
}

/// Creates a world in which the bundles have a scenario and its map. The map will be rejected.
fn both_are_read() -> World {
    let mut world = world();
    world.rejected.insert(0);
    world.write(0);
    world.write(1);
    world.prepare(1, true);
    world.prepare(0, true);
    world
}

#[test]
fn rejected_map_is_named_in_any_order() {
    for order in [[0, 1], [1, 0]] {
        for together in [true, false] {
            let mut world = world();
            world.rejected.insert(0);
            for file in order {
                world.write(file);
                if !together {
                    world.settle();
                }
            }
            world.settle();
            assert_eq!(world.said_of_maps[&1], [0], "{order:?} {together}");
            assert_eq!(world.judged[&1].1, Verdict::Rejected);
        }
    }
}

/// A scenario is read first and takes all document places of the bus. Its map must be read nevertheless.
#[test]
fn waiting_scenario_leaves_room_for_its_map() {
    let mut world = world();
    world.state.settings.max_documents = 2;
    world.lay(0, 100);
    world.write(1);
    world.prepare(0, true);
    world.find(0);
    world.settle();
    assert_eq!(world.judged[&1].1, Verdict::Accepted);
    assert_eq!(world.stored.len(), 2, "each file is stored exactly once");
}

#[test]
fn repaired_map_is_no_longer_named() {
    let mut world = world();
    world.rejected.insert(0);
    world.write(0);
    world.write(1);
    world.settle();
    world.rejected.clear();
    world.write(0);
    world.settle();
    assert!(world.said_of_maps[&1].is_empty());
    assert_eq!(world.judged[&1].1, Verdict::Accepted);
}

#[test]
fn unchanged_map_verdict_triggers_no_new_judgement() {
    let mut world = world();
    world.write(0);
    world.write(1);
    world.settle();
    let before = world.stored.len();
    world.step(&Step::Reconfigure(1));
    world.settle();
    // The new configuration makes each file be judged once.
    assert_eq!(world.stored.len(), before + 2);
}

fn storing(world: &World) -> Vec<u8> {
    let jobs = world.storing.iter();
    jobs.map(|job| file_of(&job.path)).collect()
}

/// Lets the bundles answer all their jobs.
fn answer(world: &mut World) {
    for _ in 0..8 {
        world.answer(0);
        world.answer(1);
    }
}

#[test]
fn scenario_waits_for_its_map_up_to_limit() {
    let mut world = both_are_read();
    // The writer is slow with the map.
    answer(&mut world);
    assert_eq!(storing(&world), [0]);
    world.pass(Duration::from_secs(11));
    assert_eq!(storing(&world), [0, 1], "the waiting time is limited");
    // The first result did not know the map's verdict. The second one does.
    world.settle();
    assert_eq!(world.said_of_maps[&1], [0]);
}

/// Creates a world with a run that ends (`once`). The search for its files is still under way.
fn run() -> World {
    let mut world = World::new();
    world.state = fresh_state(2, 0);
    world.state.settings.once = true;
    world.join("First");
    world.join("Second");
    world
}

#[test]
fn run_reports_scenario_once_despite_late_map() {
    let mut world = run();
    world.rejected.insert(0);
    world.lay(0, 100);
    world.write(1);
    world.prepare(0, true);
    answer(&mut world);
    assert!(storing(&world).is_empty(), "the map may still be found");
    world.find(0);
    world.event(Event::Scanned);
    assert!(storing(&world).is_empty(), "the map is judged first");
    world.settle();
    assert_eq!(world.said_of_maps[&1], [0]);
    let told = world.stored.iter().filter(|it| **it == 1);
    assert_eq!(told.count(), 1);
}

#[test]
fn run_judges_map_outside_its_files() {
    let mut world = run();
    world.rejected.insert(0);
    world.lay(0, 100);
    world.write(1);
    world.event(Event::Scanned);
    world.settle();
    assert_eq!(world.said_of_maps[&1], [0]);
    assert_eq!(world.stored, [0, 1]);
}

#[test]
fn own_verdict_run_does_not_wait_for_outside_map() {
    let mut world = run();
    world.state.settings.own_verdicts = true;
    world.lay(0, 100);
    world.write(1);
    world.prepare(0, true);
    answer(&mut world);
    assert!(storing(&world).is_empty());
    world.event(Event::Scanned);
    assert_eq!(storing(&world), [1]);
}

#[test]
fn client_gets_scenario_verdict_only_after_its_map() {
    let mut world = both_are_read();
    world.wait(1);
    answer(&mut world);
    world.pass(Duration::from_secs(11));
    // The scenario is stored without its map's verdict. It is undetermined, and no client gets this verdict.
    world.store(1, true);
    assert_eq!(world.judged[&1].1, Verdict::Undetermined);
    assert!(!world.waiting.is_empty(), "the map has no verdict yet");
    world.settle();
    assert!(world.waiting.is_empty());
    assert_eq!(world.judged[&1].1, Verdict::Rejected);
}

#[test]
fn outdated_verdict_of_killed_broker_is_renewed() {
    let mut world = world();
    world.write(0);
    world.write(1);
    world.settle();
    assert_eq!(world.judged[&1].1, Verdict::Accepted);
    // The map is rejected under another configuration. The broker is killed before it judges the scenario again.
    let map = world.journal.get_mut(&0).unwrap();
    (map.verdict, map.own, map.own_errors) = (Verdict::Rejected, Verdict::Rejected, 1);
    world.restart();
    world.settle();
    assert_eq!(world.judged[&1].1, Verdict::Rejected);
}

//! Shadows: they check every file and do not affect any verdict.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use qcbus_messages::Verdict;
use qcbus_messages::control::{Trial, TrialCounts};
use qcbus_types::{ChildSpec, FinishedJob, TaskOutcome, TrialEnd, VersionDigest};

use super::super::*;
use super::things::*;
use super::world::World;

impl World {
    /// Adds, changes or removes the manifest of the shadow.
    pub fn shadow_is(&mut self, version: Option<u8>) {
        self.shadow = version;
        self.children_are(self.manifest);
    }

    /// Checks whether the shadow has no trial left, or whether no shadow is configured.
    pub fn shadow_rests(&self) -> bool {
        let counts = self.state.trial_counts(SHADOW);
        let rests = counts.is_some_and(|it| it.waiting == 0) && self.is_there(SHADOW);
        self.shadow.is_none() || rests
    }

    /// Asserts that the shadow has tried every file or was killed by it. Call this when the world is at rest.
    pub fn all_is_tried(&self) {
        let counts = self.state.trial_counts(SHADOW);
        assert_eq!(counts.is_some(), self.shadow.is_some());
        let Some(counts) = counts else {
            return;
        };
        assert_eq!(counts.tried, self.judged.len() as u64);
        assert_eq!(self.state.trials.under_way(), 0);
    }

    fn trials(&self) -> (TrialCounts, Vec<Trial>) {
        self.state.trials(SHADOW).unwrap()
    }

    fn peer(&self, name: &str) -> u8 {
        let at = self.peers.values().position(|it| it.name == name);
        u8::try_from(at.unwrap()).unwrap()
    }

    fn jobs_at(&self, name: &str) -> usize {
        let peers = self.peers.values().filter(|it| it.name == name);
        peers.map(|it| it.jobs.len()).sum()
    }

    /// Waits until the shadow has the trial of a file.
    fn until_tried(&mut self) {
        for _ in 0..200 {
            if self.jobs_at(SHADOW) > 0 {
                return;
            }
            self.prepare(0, true);
            self.pass(Duration::from_millis(100));
        }
        panic!("the shadow must get a job: {:#?}", self.state.jobs);
    }
}

impl World {
    /// Lets the connected bundles finish all work. Only a restarted shadow may join.
    fn comes_to_rest(&mut self) {
        for _ in 0..500 {
            for n in 0..4 {
                self.prepare(n, true);
                self.answer(n);
                self.store(n, true);
                self.pool(n, true);
                self.tell_pooled();
            }
            self.child_joins();
            self.pass(Duration::from_millis(100));
            if self.state.jobs.is_empty() && self.state.files.is_quiet() && self.shadow_rests() {
                return;
            }
        }
        panic!("the world must settle: {:#?}", self.state.jobs);
    }
}

/// Returns the findings of a shadow as the store reports them: an error if it reported any issue.
pub fn found_in(job: &FinishedJob) -> TrialEnd {
    let said: Vec<_> = job.bundles.iter().map(TaskOutcome::said).collect();
    let names: Vec<&str> = said.iter().map(|it| &*it.name).collect();
    assert_eq!(names, [SHADOW], "only the shadow is asked");
    let mut checkers = said.iter().flat_map(|it| &it.checkers);
    let errors = checkers.any(|it| !it.issues.is_empty());
    let adds = match errors {
        true => Verdict::Rejected,
        false => Verdict::Accepted,
    };
    TrialEnd {
        adds,
        alone: adds,
        counts: [u64::from(errors), 0, 0],
        why: Vec::new(),
        result: None,
    }
}

/// Creates a world with a judging bundle and a connected shadow.
fn world_with_a_shadow() -> World {
    let mut world = World::new();
    world.join("First");
    world.shadow_is(Some(1));
    world.pass(Duration::ZERO);
    world.child_joins();
    assert!(world.is_there(SHADOW));
    world
}

#[test]
fn shadow_checks_all_files_without_delaying_verdicts() {
    let mut world = World::new();
    world.join("First");
    world.write(0);
    world.until_judged(1);
    world.shadow_is(Some(1));
    world.pass(Duration::ZERO);
    world.child_joins();
    world.write(2);
    // The shadow does not answer.
    for _ in 0..50 {
        world.prepare(0, true);
        world.answer(world.peer("First"));
        world.store(0, true);
    }
    assert_eq!(world.judged.len(), 2);
    assert_eq!(world.names_that_judged(2), ["First"]);
    assert_eq!(
        world.stored.len(),
        2,
        "no file is judged again because of the shadow"
    );
    assert!(world.members.contains_key("First") && !world.members.contains_key(SHADOW));
    world.comes_to_rest();
    world.all_is_tried();
    assert_eq!(world.stored.len(), 2);
}

#[test]
fn shadow_gets_single_file_at_once_after_its_verdict() {
    let mut world = world_with_a_shadow();
    for file in 0..6 {
        world.write(file);
    }
    for _ in 0..20 {
        world.prepare(0, true);
        assert!(world.jobs_at(SHADOW) <= 1);
        assert!(world.jobs_at(SHADOW) == 0 || !world.stored.is_empty());
        world.answer(world.peer("First"));
        world.store(0, true);
        world.pass(Duration::from_millis(50));
    }
    assert_eq!(world.judged.len(), 6);
    world.comes_to_rest();
    world.all_is_tried();
}

#[test]
fn hanging_shadow_delays_neither_verdicts_nor_drain() {
    let mut world = world_with_a_shadow();
    world.write(0);
    world.until_judged(1);
    world.until_tried();
    for file in 1..6 {
        world.write(file);
    }
    for _ in 0..50 {
        world.prepare(0, true);
        world.answer(world.peer("First"));
        world.store(0, true);
    }
    assert_eq!(world.judged.len(), 6);
    assert_eq!(world.jobs_at(SHADOW), 1);
    world.event(Event::Drain);
    assert_eq!(
        world.jobs_at(SHADOW),
        0,
        "the broker does not wait for the trial"
    );
    world.drain();
}

#[test]
fn shadow_that_dies_with_file_is_retried_once() {
    let mut world = world_with_a_shadow();
    world.write(0);
    world.until_judged(1);
    for _ in 0..2 {
        world.until_tried();
        world.kill(world.peer(SHADOW));
        while world.launched.is_empty() {
            world.pass(Duration::from_millis(100));
        }
        world.child_joins();
    }
    world.comes_to_rest();
    let (counts, trials) = world.trials();
    assert_eq!((counts.tried, counts.failed), (1, 1));
    assert!(
        trials[0].failure.as_ref().unwrap().contains("failed"),
        "{trials:?}"
    );
    assert_eq!(
        world.judged[&0].1,
        Verdict::Accepted,
        "a failed trial does not change the verdict"
    );
    assert_eq!(world.stored.len(), 1);
}

#[test]
fn verdicts_changed_by_shadow_are_reported() {
    let mut world = world_with_a_shadow();
    for file in [0, 2] {
        world.write(file);
    }
    world.until_judged(2);
    world.until_tried();
    let process = world.peer(SHADOW);
    // The shadow finds nothing in the first file and an error in the second.
    world.answers_with(process, 0);
    world.pool(0, true);
    world.tell_pooled();
    world.until_tried();
    world.answers_with(world.peer(SHADOW), 1);
    world.pool(0, true);
    world.tell_pooled();
    let (counts, trials) = world.trials();
    assert_eq!(
        (counts.tried, counts.would_reject, counts.waiting),
        (2, 1, 0)
    );
    assert_eq!(trials.len(), 1);
    assert_eq!(
        (trials[0].verdict, trials[0].would),
        (Verdict::Accepted, Verdict::Rejected)
    );
    assert_eq!(world.state.status().files.rejected, 0);
    let rejected = trials[0].file.clone();
    world.delete(file_of(&rejected));
    let (counts, trials) = world.trials();
    assert_eq!((counts.tried, counts.would_reject), (1, 0));
    assert!(trials.is_empty());
}

#[test]
fn newer_shadow_tries_everything_again_and_same_one_nothing() {
    let mut world = world_with_a_shadow();
    world.write(0);
    world.comes_to_rest();
    let done = |world: &World| world.state.bundles[SHADOW].done;
    assert_eq!(done(&world), 1);
    world.kill(world.peer(SHADOW));
    world.comes_to_rest();
    assert_eq!(world.trials().0.tried, 1);
    let before = done(&world);
    world.shadow_is(Some(2));
    world.comes_to_rest();
    assert_eq!(world.trials().0.tried, 1);
    assert_eq!(done(&world), before + 1);
}

#[test]
fn joining_shadow_triggers_no_trials_of_others() {
    let mut world = world_with_a_shadow();
    world.write(0);
    world.comes_to_rest();
    let before = world.trials().0;
    let mut actions = Vec::new();
    world
        .state
        .shadow_is_ready("Another", VersionDigest(1), &mut actions);
    let waiting = |name: &str| world.state.trial_counts(name).unwrap().waiting;
    assert_eq!((waiting("Another"), world.trials().0), (1, before));
}

/// After a restart a shadow may be ready before the watcher has seen the files. The journal already
/// knows their verdicts.
#[test]
fn early_shadow_tries_files_seen_later() {
    let seen: [fn(Arc<Path>, Stamp) -> Event; 2] = [
        |path, stamp| Event::Settled { path, stamp },
        |path, _| Event::Present { path },
    ];
    for seen in seen {
        let mut world = world_with_a_shadow();
        world.write(0);
        world.comes_to_rest();
        let path = path_of(0);
        let id = world.state.files.id(&path).unwrap();
        let entry = world.state.files.get_mut(id).unwrap();
        entry.present = false;
        let stamp = entry.stamp;
        let mut actions = Vec::new();
        world
            .state
            .shadow_is_ready("Another", VersionDigest(1), &mut actions);
        let waiting = |world: &World| world.state.trial_counts("Another").unwrap().waiting;
        assert_eq!(waiting(&world), 0);
        for _ in 0..2 {
            let path = path.clone();
            world.event(seen(path, stamp));
            assert_eq!(waiting(&world), 1);
        }
    }
}

#[test]
fn bundle_is_required_only_while_it_is_no_shadow() {
    let mut world = world_with_a_shadow();
    world.write(0);
    world.comes_to_rest();
    let judge = ChildSpec {
        shadow: false,
        ..shadow(1)
    };
    // From now on the bundle must judge, even while its next process is missing.
    world.event(Event::Children {
        specs: vec![judge.clone()],
    });
    let id = world.state.files.id(&path_of(0)).unwrap();
    let stands = |world: &World| {
        let entry = world.state.files.get(id).unwrap();
        world
            .state
            .stands(entry.kind, entry.judged.as_ref().unwrap())
    };
    assert!(
        !stands(&world),
        "a verdict without the new bundle is no longer valid"
    );
    assert!(
        world.members.contains_key(SHADOW),
        "the journal records the new required bundle"
    );
    assert_eq!(world.state.trials(SHADOW), None);
    world.event(Event::Children {
        specs: vec![shadow(1)],
    });
    assert!(stands(&world));
    assert!(!world.members.contains_key(SHADOW));
    assert!(world.state.trials(SHADOW).is_some());
}

#[test]
fn shadow_is_never_treated_as_flapping() {
    let mut world = world_with_a_shadow();
    world.state.settings.changes_forgiven = 2;
    world.write(0);
    world.comes_to_rest();
    for _ in 0..8 {
        world.kill(world.peer(SHADOW));
        while world.launched.is_empty() {
            world.pass(Duration::from_millis(100));
        }
        world.child_joins();
        assert!(
            world.state.bundles[SHADOW].ready,
            "the shadow is accepted at once"
        );
    }
    assert_eq!(world.stored.len(), 1);
}

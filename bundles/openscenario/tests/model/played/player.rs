//! A small simulator that plays storyboards step by step, as the standard describes it. Values that
//! only a run can tell are drawn at random.

mod looks;

use std::collections::HashMap;

use looks::Look;
use qcbus_openscenario::{Condition, Plan, Priority, Start, State, StoryKind, Takes, Trigger};

/// Step in seconds.
const STEP: f64 = 0.05;

/// Number of steps of a run without an end.
const MOST_STEPS: usize = 500;

/// What happened to an element: times in seconds.
#[derive(Debug, Clone, Default)]
pub struct Life {
    pub start: Option<f64>,
    pub end: Option<f64>,
    pub complete: Option<f64>,
    pub stopped: Option<f64>,
}

/// What happened in a run.
#[derive(Debug)]
pub struct Run {
    pub lives: Vec<Life>,
    /// Time of the last step.
    pub until: f64,
    /// Whether the stop trigger of the storyboard ended it.
    pub stopped: bool,
}

/// Plays a storyboard. A lenient simulator deviates from the standard as known ones do.
pub fn play(plan: &Plan, seed: u64, is_lenient: bool) -> Run {
    let mut player = Player::new(plan, seed, is_lenient);
    for step in 0..MOST_STEPS {
        player.step = step;
        if player.is_over() {
            return player.finish(true);
        }
        player.run();
    }
    player.finish(false)
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Its parent has not started it yet.
    Idle,
    Standby,
    Running,
    Complete,
}

struct Player<'p> {
    plan: &'p Plan,
    random: u64,
    step: usize,
    phases: Vec<Phase>,
    /// Executions of each element: starts and skips.
    counts: Vec<u32>,
    /// Step at which each action ends.
    ends: Vec<usize>,
    /// Transitions of the last step and of this one.
    seen: Vec<(usize, State)>,
    now: Vec<(usize, State)>,
    /// Phases at the end of the last step.
    before: Vec<Phase>,
    lives: Vec<Life>,
    looks: HashMap<*const Condition, Look>,
    /// Whether the stop trigger of an act counts before the act has started. Simulators differ.
    stops_waiting_acts: bool,
    /// Whether the simulator deviates as known ones do: conditions see each change since they were
    /// last looked at, they are not looked at if others of their group are false, actions and
    /// events that others stop end regularly, and elements whose parent waits are not stopped.
    is_lenient: bool,
    /// Changes of all elements: step that sees it, element and its new state or its transition.
    changes: Vec<(usize, usize, State)>,
    /// Step in which a condition was last looked at.
    looked: HashMap<*const Condition, usize>,
}

impl<'p> Player<'p> {
    fn new(plan: &'p Plan, seed: u64, is_lenient: bool) -> Player<'p> {
        let count = plan.parts.len();
        let mut player = Player {
            plan,
            random: seed | 1,
            step: 0,
            phases: vec![Phase::Idle; count],
            counts: vec![0; count],
            ends: vec![0; count],
            seen: Vec::new(),
            now: Vec::new(),
            before: vec![Phase::Idle; count],
            lives: vec![Life::default(); count],
            looks: HashMap::new(),
            stops_waiting_acts: seed.is_multiple_of(2),
            is_lenient,
            changes: Vec::new(),
            looked: HashMap::new(),
        };
        for place in 0..count {
            if plan.parts[place].parent.is_none() {
                player.begin(place);
            }
        }
        player.before.clone_from(&player.phases);
        player.seen = std::mem::take(&mut player.now);
        player.changes.iter_mut().for_each(|change| change.0 = 0);
        player
    }

    fn draw(&mut self) -> u64 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 7;
        self.random ^= self.random << 17;
        self.random
    }

    fn time(&self) -> f64 {
        self.step as f64 * STEP
    }

    fn children(&self, place: usize) -> Vec<usize> {
        let parts = self.plan.parts.iter().enumerate();
        parts
            .filter(|(_, part)| part.parent == Some(place))
            .map(|(at, _)| at)
            .collect()
    }

    /// Starts an element, and those within it that have no trigger.
    fn begin(&mut self, place: usize) {
        self.change(place, Phase::Running, State::StartTransition);
        self.counts[place] += 1;
        let time = self.time();
        self.lives[place].start.get_or_insert(time);
        if self.plan.parts[place].kind == StoryKind::Action {
            let seconds = match self.plan.parts[place].takes {
                Takes::NoTime => 0.0,
                Takes::Seconds(seconds) => seconds,
                Takes::Forever | Takes::ForeverInTheory => f64::from(u32::MAX),
                Takes::Unknown => (self.draw() % 40) as f64 / 2.0,
            };
            self.ends[place] = self.step + (seconds / STEP).round() as usize;
            for rival in self
                .plan
                .parts
                .iter()
                .enumerate()
                .filter_map(|(at, part)| part.rivals.contains(&place).then_some(at))
            {
                if self.phases[rival] == Phase::Running {
                    self.stop_for_another(rival);
                }
            }
        }
        for child in self.children(place) {
            self.counts[child] = 0;
            match self.plan.parts[child].start {
                Start::WithParent => self.begin(child),
                _ => {
                    self.phases[child] = Phase::Standby;
                    self.changes.push((self.step + 1, child, State::Standby));
                }
            }
        }
    }

    fn change(&mut self, place: usize, phase: Phase, transition: State) {
        self.phases[place] = phase;
        self.now.push((place, transition));
        let state = match phase {
            Phase::Running => State::Running,
            Phase::Complete => State::Complete,
            Phase::Idle | Phase::Standby => State::Standby,
        };
        for one in [state, transition] {
            self.changes.push((self.step + 1, place, one));
        }
    }

    /// Stops an element because of another one.
    fn stop_for_another(&mut self, place: usize) {
        if !self.is_lenient {
            return self.stop(place);
        }
        for child in self.children(place) {
            if self.phases[child] == Phase::Running {
                self.complete(child, State::EndTransition);
            }
        }
        self.ended(place);
    }

    fn complete(&mut self, place: usize, transition: State) {
        self.change(place, Phase::Complete, transition);
        let time = self.time();
        let life = &mut self.lives[place];
        life.complete.get_or_insert(time);
        match transition {
            State::EndTransition => life.end.get_or_insert(time),
            State::StopTransition => life.stopped.get_or_insert(time),
            _ => return,
        };
    }

    /// Stops an element and everything within it.
    fn stop(&mut self, place: usize) {
        for child in self.children(place) {
            let is_left_out = self.is_lenient && self.phases[child] == Phase::Idle;
            if self.phases[child] != Phase::Complete && !is_left_out {
                self.stop(child);
            }
        }
        self.complete(place, State::StopTransition);
    }

    fn is_over(&mut self) -> bool {
        let plan = self.plan;
        plan.stop.as_ref().is_some_and(|stop| self.triggers(stop))
    }

    fn run(&mut self) {
        let plan = self.plan;
        for place in 0..plan.parts.len() {
            let part = &plan.parts[place];
            if let Some(stop) = part
                .stop
                .as_ref()
                .filter(|_| self.may_stop(self.before[place]))
                && self.triggers(stop)
                && self.may_stop(self.phases[place])
            {
                self.stop(place);
            }
            let Start::By(trigger) = &part.start else {
                continue;
            };
            if self.before[place] == Phase::Standby && self.phases[place] == Phase::Standby {
                if self.triggers(trigger) {
                    self.triggered(place);
                }
            } else {
                self.forget(trigger);
            }
        }
        for place in (0..plan.parts.len()).rev() {
            if self.phases[place] == Phase::Running && self.is_done(place) {
                self.ended(place);
            }
        }
        self.before.clone_from(&self.phases);
        self.seen = std::mem::take(&mut self.now);
    }

    /// Checks whether the stop trigger of an act in this phase is looked at.
    fn may_stop(&self, phase: Phase) -> bool {
        phase == Phase::Running || (self.stops_waiting_acts && phase == Phase::Standby)
    }

    /// Conditions are looked at only while their element waits.
    fn forget(&mut self, trigger: &Trigger) {
        for condition in trigger.groups.iter().flatten() {
            self.looks.remove(&std::ptr::from_ref(condition));
        }
    }

    fn triggered(&mut self, place: usize) {
        let part = &self.plan.parts[place];
        let others: Vec<usize> = match part.parent {
            Some(parent) => self.children(parent),
            None => Vec::new(),
        };
        let running: Vec<usize> = others
            .into_iter()
            .filter(|it| *it != place && self.phases[*it] == Phase::Running)
            .collect();
        if part.kind == StoryKind::Event {
            match part.priority {
                Priority::Skip if !running.is_empty() => {
                    self.counts[place] += 1;
                    if Some(self.counts[place]) == part.executions {
                        self.complete(place, State::SkipTransition);
                    }
                    return;
                }
                Priority::Override => running.into_iter().for_each(|it| self.stop_for_another(it)),
                _ => {}
            }
        }
        self.begin(place);
    }

    fn is_done(&self, place: usize) -> bool {
        match self.plan.parts[place].kind {
            StoryKind::Action => self.step >= self.ends[place],
            _ => {
                let children = self.children(place);
                children
                    .iter()
                    .all(|it| self.phases[*it] == Phase::Complete)
            }
        }
    }

    fn ended(&mut self, place: usize) {
        let part = &self.plan.parts[place];
        let is_last = part.executions == Some(self.counts[place]);
        if part.kind == StoryKind::Event && !is_last {
            self.change(place, Phase::Standby, State::EndTransition);
            let time = self.time();
            self.lives[place].end.get_or_insert(time);
        } else if part.kind == StoryKind::ManeuverGroup && !is_last {
            self.now.push((place, State::EndTransition));
            let time = self.time();
            self.lives[place].end.get_or_insert(time);
            self.begin(place);
        } else {
            self.complete(place, State::EndTransition);
        }
    }

    fn finish(self, stopped: bool) -> Run {
        Run {
            until: self.time(),
            lives: self.lives,
            stopped,
        }
    }
}

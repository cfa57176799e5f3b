//! A scenario is played on paper: when each element of its storyboard can start and end.
//!
//! [`Plan`] is the storyboard as a state machine, [`Spans`] are the bounds for the start and the end
//! of each element. What the scenario does not fix is unknown, and nothing follows from it.

mod condition;
mod impossible;
mod moment;
mod of_scenario;
mod plan;
mod play;
mod rivals;
mod takes;
mod time_of_day;
mod why;

pub use impossible::{Impossible, Reason};
pub use moment::Moment;
pub use plan::{
    Comparison, Condition, Edge, Logic, Plan, Priority, Start, State, StoryPart, Takes, Trigger,
};
pub use play::{Span, Spans, Strictness};
pub use why::{At, Cause};

use std::sync::OnceLock;

use crate::queries::scenario::Scenario;
use plan::Tree;

/// When the elements of a storyboard start and end.
#[derive(Debug)]
pub struct Timeline {
    /// The storyboard that was played.
    pub plan: Plan,
    /// Bounds by the standard.
    pub standard: Spans,
    /// Bounds that hold in every known simulator.
    tolerant: OnceLock<Spans>,
}

impl Timeline {
    fn of(scenario: &Scenario<'_>) -> Option<Timeline> {
        let plan = of_scenario::plan(scenario)?;
        Some(Timeline {
            standard: Spans::of(&plan, Strictness::Standard),
            tolerant: OnceLock::new(),
            plan,
        })
    }

    /// Returns bounds that hold in every known simulator.
    pub fn tolerant(&self) -> &Spans {
        self.tolerant
            .get_or_init(|| Spans::of(&self.plan, Strictness::Tolerant))
    }

    /// Returns the bounds of one reading.
    pub fn spans(&self, strictness: Strictness) -> &Spans {
        match strictness {
            Strictness::Standard => &self.standard,
            Strictness::Tolerant => self.tolerant(),
        }
    }

    /// Returns the causes, one for each condition group, why an element never starts. The list is
    /// empty if it may start, or if only its parent never starts.
    pub fn never_starts(&self, place: usize, strictness: Strictness) -> Vec<Cause> {
        why::never_starts(&self.plan, self.spans(strictness), strictness, place)
    }

    /// Returns the moment at which the run or the act around an element ends, by the standard.
    pub fn end_around(&self, place: usize) -> Moment {
        self.standard.stop_of(&Tree::of(&self.plan), place)
    }

    /// Returns the causes, one for each condition group, why the run never ends. The list is empty
    /// if it may end, or if it has no stop trigger.
    pub fn never_ends(&self, strictness: Strictness) -> Vec<Cause> {
        why::never_ends(&self.plan, self.spans(strictness), strictness)
    }
}

impl Scenario<'_> {
    /// Plays the storyboard. Returns `None` if a part of it is unknown, such as a maneuver of a
    /// missing catalog.
    pub fn timeline(&self) -> Option<&Timeline> {
        self.timeline.get_or_init(|| Timeline::of(self)).as_ref()
    }
}

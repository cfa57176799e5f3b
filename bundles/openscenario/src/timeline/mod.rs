//! A scenario is played on paper: when each element of its storyboard can start and end.
//!
//! [`Plan`] is the storyboard as a state machine, [`Spans`] are the bounds for the start and the end
//! of each element. What the scenario does not fix is unknown, and nothing follows from it.

mod condition;
mod moment;
mod plan;
mod play;

pub use moment::Moment;
pub use plan::{
    Comparison, Condition, Edge, Logic, Part, Plan, Priority, Start, State, Takes, Trigger,
};
pub use play::{Span, Spans, Strictness};

//! Types that the crates of the broker share: files and their versions, jobs, verdicts, processes,
//! and the events and actions of the state machine. They do no I/O.

mod action;
mod event;
mod notice;
mod outcome;
mod requests;
mod required_set;
mod settings;
mod size;
mod values;

pub use action::Action;
pub use event::Event;
pub use notice::Notice;
pub use outcome::{Answer, Pending, TaskOutcome};
pub use requests::{OnDemand, OnDemandOutcome, TrialEnd, Until};
pub use required_set::{
    Epoch, Member, Origin, RequiredBundle, RequiredSet, Requirement, VersionDigest,
};
pub use settings::Settings;
pub use size::{clip, clip_text, facts_weight, weight};
pub use values::*;

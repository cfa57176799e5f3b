//! A plan view of a road network, small enough to be sent, and where findings lie on it.
//!
//! [`Plan::of`] takes a map of the OpenDRIVE model to lines in whole centimetres, each point with the coarsest
//! level of detail that still needs it, and writes them in the binary form that `docs/html-report.md` describes
//! (section "`plan`"). [`Locator`] leads what a finding says about its place to a point and to the roads, lanes,
//! junctions, signals and objects of the same plan.
//!
//! Maps are hostile: whatever has no finite place, lies too far away or would take too much work is left out, and
//! [`Plan::cuts`] says so. The work is bounded by the size of the file.

mod columns;
mod encode;
mod frame;
mod furniture;
mod hull;
mod junction;
mod locate;
mod origin;
mod plan;
mod road;
mod sample;
mod section;
mod simplify;
mod writer;

pub use locate::{How, Locator, Said, Spot, Target};
pub use plan::Plan;

//! A small plan view of a road network for transfer, and the places of findings on it.
//!
//! [`Plan::of`] converts a map of the OpenDRIVE model to lines in whole centimetres. Each point has
//! the coarsest level of detail that still needs it. The binary format is described in
//! `docs/html-report.md` (section "`plan`"). [`Locator`] converts the place data of a finding to a
//! point. It also finds the roads, lanes, junctions, signals and objects of the same plan.
//!
//! Maps may be hostile. Elements without a finite place, too far away or with too much work are
//! left out, and [`Plan::cuts`] reports them. The work is bounded by the size of the file.

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

//! Shared code of the benches: generated maps and answers, peers that only answer, figures and
//! tables.
//!
//! Every bench is a program of its own (`cargo bench -p qcbus-benches --bench NAME`) and prints
//! Markdown, so that the tables of `docs/evidence/performance.md` can be made again.

pub mod answers;
pub mod farm;
pub mod figures;
pub mod machine;
pub mod maps;
pub mod peers;
pub mod scenarios;

/// Result of a bench. Every error ends the bench.
pub type Result<T> = std::result::Result<T, Box<dyn std::error::Error>>;

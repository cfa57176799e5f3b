//! ASAM's file formats: configuration (`.xml`), manifests (`.json`) and results (`.xqar`). It also
//! pools the findings of bundles into one result.
//!
//! This crate performs no I/O: functions take and return bytes, text and values. [`manifest`] takes
//! a function that reads files, because one file refers to others.

pub mod config;
pub mod distance;
pub mod location;
pub mod manifest;
pub mod markup;
pub mod pool;
mod text;
pub mod verdict;
pub mod xqar;

mod xml;

pub use text::Text;
pub use verdict::Verdict;

//! ASAM's file formats: configuration (`.xml`), manifests (`.json`) and results (`.xqar`), and
//! the pooling of what bundles found into one result.
//!
//! Nothing here does I/O: bytes and values go in, values and text come out. [`manifest`], where
//! one file leads to others, takes a function that reads files.

pub mod config;
pub mod distance;
pub mod location;
pub mod manifest;
pub mod pool;
mod text;
pub mod verdict;
pub mod xqar;

mod xml;

pub use text::Text;
pub use verdict::Verdict;

#[doc(hidden)]
pub mod fuzzing;

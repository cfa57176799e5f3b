//! The page of a rule: text for people, and examples that run as tests.
//!
//! A page is Markdown. Its first heading is the title, its first paragraph the summary. Code blocks
//! marked `xml good`, `xml bad` or `xml skipped` are examples, see [`Example`]. The block marked
//! `issues` after a bad example contains the findings of the rule in it.

mod bless;
pub mod evidence;
mod example;
mod harness;
mod parse;
mod render;

pub use example::{Template, Verdict};
pub use harness::{assert_pages, check_pages};
pub use parse::{Example, ExampleFile, Page, PageError};

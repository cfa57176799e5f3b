//! Turns text into the events of a tree. quick-xml finds the markup with unusual spelling. This
//! module makes the checks that quick-xml omits.

pub(crate) mod chars;
mod escape;
mod includes;
mod namespaces;
mod parser;
mod plain;
mod sink;
mod tag;
mod value;

pub(crate) use escape::escape_into;
pub(crate) use includes::{Include, first_element, includes_of};
pub(crate) use parser::{Input, SourceText, Splice, SpliceKey, parse};
pub(crate) use sink::{Counter, Halt, Sink};

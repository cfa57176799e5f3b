//! From text to the events of a tree: quick-xml finds the markup that is not spelt as nearly all is, the
//! checks that it leaves out are made here.

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

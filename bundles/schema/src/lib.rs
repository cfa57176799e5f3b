//! XML Schema for the bus: a compiler from XSD to compact tables, and a validator that walks a
//! document image once.
//!
//! The project contains no XSD. It ships the tables of the published OpenDRIVE and OpenSCENARIO
//! schemas. They use an own notation, which the compiler writes (`qcbus schema compile`).

mod assertion;
mod automaton;
mod check;
mod compile;
mod constraint;
mod defects;
mod edition;
mod later;
mod model;
mod names;
mod notation;
mod pattern;
mod recursion;
mod similar;
mod simple;
#[cfg(test)]
mod tests;
mod typing;
mod user_schemas;
mod validate;
mod versions;
mod violation;
mod work;

pub use assertion::XPathProblem;
pub use check::{Checked, Fact, Options, Outcome, Override, Severity, Source, check};
pub use compile::{CompileError, Problem, compile};
#[doc(hidden)]
pub use defects::known_conditions;
pub use edition::Edition;
pub use later::{Later, Thing};
pub use model::Schema;
pub use notation::NotationError;
pub use pattern::{Pattern, PatternError};
pub use similar::closest;
pub use simple::Expectation;
pub use typing::{Member, Typing, ValueType, came_with};
pub use user_schemas::{UserSchemaContent, UserSchemaError, UserSchemaFile, user_schemas};
pub use validate::Overlay;
pub use versions::{SHIPPED, Shipped, SkipReason, Version, version_of};
pub use violation::{Code, Detail, Limits, Report, Rest, Violation};

//! Tests of the model of a scenario.

mod common;

mod catalogs;
mod expressions;
mod expressions_hostile;
mod expressions_oracle;
mod own_start;
mod played;
mod values;

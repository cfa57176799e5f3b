//! Algorithms that several rules share.

pub(crate) mod names;

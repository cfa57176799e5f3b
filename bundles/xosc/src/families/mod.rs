//! Algorithms that several rules share.

pub(crate) mod names;
pub(crate) mod references;
pub(crate) mod values;

//! Code that several rules share.

pub mod copies;
pub mod file_faults;
pub mod finds;
pub mod offers;
pub mod typings;

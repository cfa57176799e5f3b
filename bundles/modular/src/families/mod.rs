//! What several rules have in common.

pub mod copies;
pub mod file_faults;
pub mod finds;
pub mod offers;
pub mod typings;

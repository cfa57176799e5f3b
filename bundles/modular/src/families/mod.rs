//! What several rules have in common.

pub mod offers;
//! What several rules do alike.

pub mod copies;
pub mod finds;
pub mod typings;
pub mod file_faults;

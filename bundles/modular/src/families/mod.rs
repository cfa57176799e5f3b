//! What several rules have in common.

pub mod offers;

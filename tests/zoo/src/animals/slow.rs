//! Takes `--millis` of time for every job and otherwise behaves correctly.

use crate::harness::{Animal, GOOD};

pub(super) const ANIMAL: Animal = Animal {
    name: "slow",
    ..GOOD
};

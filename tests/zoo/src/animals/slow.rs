//! Takes its time for every job, `--millis` of it; otherwise polite.

use crate::keeper::{Animal, GOOD};

pub(super) const ANIMAL: Animal = Animal {
    name: "slow",
    ..GOOD
};

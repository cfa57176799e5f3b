//! Says hello without having said to the broker's socket which process it is.

use qcbus_bus::Claims;

use crate::keeper::{Animal, GOOD, HONEST};

pub(super) const ANIMAL: Animal = Animal {
    name: "proves_nothing",
    claims: Claims {
        proves: false,
        ..HONEST
    },
    ..GOOD
};

//! Sends its hello without having proved its process identity to the broker's socket.

use qcbus_bus::Claims;

use crate::harness::{Animal, GOOD, HONEST};

pub(super) const ANIMAL: Animal = Animal {
    name: "proves_nothing",
    claims: Claims {
        proves: false,
        ..HONEST
    },
    ..GOOD
};

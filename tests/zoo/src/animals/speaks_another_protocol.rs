//! Claims to be built for another version of the messages.

use qcbus_bus::Claims;
use qcbus_messages::PROTOCOL_VERSION;

use crate::harness::{Animal, GOOD, HONEST};

/// Protocol version that it claims.
pub const PROTOCOL: u32 = PROTOCOL_VERSION + 41;

pub(super) const ANIMAL: Animal = Animal {
    name: "speaks_another_protocol",
    claims: Claims {
        protocol: PROTOCOL,
        ..HONEST
    },
    ..GOOD
};

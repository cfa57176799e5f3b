//! Was built for another version of the messages, and says so.

use qcbus_bus::Claims;
use qcbus_messages::PROTOCOL_VERSION;

use crate::keeper::{Animal, GOOD, HONEST};

/// The version that it claims to speak.
pub const PROTOCOL: u32 = PROTOCOL_VERSION + 41;

pub(super) const ANIMAL: Animal = Animal {
    name: "speaks_another_protocol",
    claims: Claims {
        protocol: PROTOCOL,
        ..HONEST
    },
    ..GOOD
};

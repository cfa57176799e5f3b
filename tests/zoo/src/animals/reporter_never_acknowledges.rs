//! A reporter that accepts results and sends heartbeats, but never reports that a result is
//! written.

use qcbus_bus::Peer;
use qcbus_messages::{JobId, Role};

use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "reporter_never_acknowledges",
    role: Role::Reporter,
    manners: Manners {
        result,
        ..GOOD.manners
    },
    ..GOOD
};

fn result(_: &mut Peer, _: JobId) -> Mood {
    Mood::GoOn
}

//! Joins the bus and never sends its catalogue.

use qcbus_bus::Peer;

use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "hangs_after_hello",
    manners: Manners {
        welcomed,
        ..GOOD.manners
    },
    ..GOOD
};

fn welcomed(_: &mut Peer) -> Mood {
    Mood::Freeze
}

//! Allocates more and more memory for a job, until the system refuses.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "allocates_forever",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Bytes allocated at once.
const BITE: usize = 8 << 20;
/// Total at which it stops by itself, so that a machine survives a broker without a memory limit.
const FED: usize = 4 << 30;

fn job(_: &mut Peer, _: &Job) -> Mood {
    let mut eaten: Vec<Vec<u8>> = Vec::new();
    while eaten.len() * BITE < FED {
        // The memory is written to, because untouched memory is not really allocated.
        eaten.push(vec![0xEE; BITE]);
    }
    drop(eaten);
    Mood::Die
}

//! Says of its run what no message may hold.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use super::floods_metadata;
use crate::keeper::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "floods_with_huge_messages",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Bytes of each message.
const TEXT: usize = 60_000_000;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    floods_metadata::say(peer, job, TEXT);
    Mood::GoOn
}

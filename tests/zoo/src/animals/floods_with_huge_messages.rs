//! Sends more metadata of its run than a message may contain.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use super::floods_metadata;
use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "floods_with_huge_messages",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Bytes per message.
const TEXT: usize = 60_000_000;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    floods_metadata::say(peer, job, TEXT);
    Mood::GoOn
}

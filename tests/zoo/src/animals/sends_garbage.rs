//! Answers a job with bytes that are not a message.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood, answer};

pub(super) const ANIMAL: Animal = Animal {
    name: "sends_garbage",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(peer: &mut Peer, job: &Job) -> Mood {
    for size in [1, 64, 40_000] {
        peer.send_garbage(&vec![0xA5; size]);
    }
    answer(peer, job.job);
    Mood::GoOn
}

//! Crashes on every job.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "dies_on_every_job",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(_: &mut Peer, _: &Job) -> Mood {
    Mood::Die
}

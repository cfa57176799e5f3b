//! Accepts a job and never answers again, like a checker in an endless loop.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "hangs_in_a_job",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(_: &mut Peer, _: &Job) -> Mood {
    Mood::Freeze
}

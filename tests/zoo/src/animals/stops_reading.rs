//! Joins, says what it checks, and then reads nothing any more.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::keeper::{Animal, GOOD, Manners, Mood, checker_done};

pub(super) const ANIMAL: Animal = Animal {
    name: "stops_reading",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// It reads up to its first job, so that the broker has given it all that it takes at once.
fn job(peer: &mut Peer, job: &Job) -> Mood {
    checker_done(peer, job.job, 0);
    Mood::Freeze
}

//! Accepts jobs and sends heartbeats, but never reports that a job is done.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood, checker_done};

pub(super) const ANIMAL: Animal = Animal {
    name: "never_acknowledges",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(peer: &mut Peer, job: &Job) -> Mood {
    checker_done(peer, job.job, 0);
    Mood::GoOn
}

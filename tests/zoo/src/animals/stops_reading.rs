//! Joins the bus, sends its catalogue, and then stops reading.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood, checker_done};

pub(super) const ANIMAL: Animal = Animal {
    name: "stops_reading",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Stops reading at the first job. By then the broker has sent as many jobs as it accepts at once.
fn job(peer: &mut Peer, job: &Job) -> Mood {
    checker_done(peer, job.job, 0);
    Mood::Freeze
}

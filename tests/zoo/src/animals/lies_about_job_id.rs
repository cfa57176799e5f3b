//! Sends many messages about jobs that it was never given, and about checkers that it does not
//! have.

use qcbus_bus::Peer;
use qcbus_messages::{FromPeer, Job, JobId};

use crate::harness::{Animal, GOOD, Manners, Mood, answer, checker_done};

pub(super) const ANIMAL: Animal = Animal {
    name: "lies_about_job_id",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// False job ids per job.
const LIES: u64 = 100;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    for lie in 1..=LIES {
        answer(peer, JobId(job.job.0 + lie));
        checker_done(peer, job.job, 1000);
        let job = JobId(job.job.0.wrapping_sub(lie));
        peer.send(&FromPeer::JobDone { job, micros: 0 });
    }
    Mood::GoOn
}

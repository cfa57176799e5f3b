//! Has nothing to report and no end of facts about its run, each message just small enough to be taken.

use qcbus_bus::Peer;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Metadata;
use qcbus_messages::{CheckerEnd, FromPeer, Job};

use crate::keeper::{Animal, CHECKERS, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "floods_metadata",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Messages for each job.
const MESSAGES: u32 = 30;
/// Bytes of the facts in each.
const TEXT: usize = 3 << 20;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    say(peer, job, TEXT);
    Mood::GoOn
}

/// Ends the checkers again and again, with facts of so many bytes each time, and the job.
pub(super) fn say(peer: &mut Peer, job: &Job, bytes: usize) {
    let fact = Metadata {
        key: "zoo.fact".to_owned(),
        value: "x".repeat(bytes),
        description: String::new(),
    };
    for number in 0..MESSAGES {
        peer.send(&FromPeer::CheckersDone {
            job: job.job,
            ended: vec![CheckerEnd {
                checker: number % CHECKERS,
                ending: Ending::Completed,
                params: Vec::new(),
                metadata: vec![fact.clone()],
            }],
        });
    }
    peer.send(&FromPeer::JobDone {
        job: job.job,
        micros: 1,
    });
}

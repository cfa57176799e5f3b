//! Reports no issues but far too much metadata of its run. Each message is just small enough to be
//! accepted.

use qcbus_bus::Peer;
use qcbus_formats::pool::Ending;
use qcbus_formats::xqar::Metadata;
use qcbus_messages::{CheckerEnd, FromPeer, Job};

use crate::harness::{Animal, CHECKERS, GOOD, Manners, Mood};

pub(super) const ANIMAL: Animal = Animal {
    name: "floods_metadata",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Messages per job.
const MESSAGES: u32 = 30;
/// Bytes of metadata per message.
const TEXT: usize = 3 << 20;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    say(peer, job, TEXT);
    Mood::GoOn
}

/// Reports the end of the checkers repeatedly, each time with `bytes` of metadata. Then it ends the
/// job.
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

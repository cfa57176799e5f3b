//! Reports far more issues than a file can have, each with a long description.

use qcbus_bus::Peer;
use qcbus_formats::xqar::{Issue, Level};
use qcbus_messages::{FromPeer, Job};

use crate::harness::{Animal, CHECKERS, GOOD, Manners, Mood, checker_done};

pub(super) const ANIMAL: Animal = Animal {
    name: "floods_issues",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Batches per job.
const BATCHES: usize = 300;
/// Issues per batch.
const BATCH: usize = 64;
/// Bytes per description.
const TEXT: usize = 2000;

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let issue = Issue {
        id: 0,
        description: "x".repeat(TEXT),
        level: Level::Warning,
        rule_uid: "example.org:xodr:1.0.0:zoo.0".to_owned(),
        locations: Vec::new(),
        domain_info: Vec::new(),
    };
    for _ in 0..BATCHES {
        peer.send(&FromPeer::Issues {
            job: job.job,
            checker: 0,
            issues: vec![issue.clone(); BATCH],
        });
    }
    for checker in 0..CHECKERS {
        checker_done(peer, job.job, checker);
    }
    peer.send(&FromPeer::JobDone {
        job: job.job,
        micros: 1,
    });
    Mood::GoOn
}

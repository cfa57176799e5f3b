//! Reports a changed catalogue again and again, so that everything would have to be judged again.

use std::sync::atomic::{AtomicU64, Ordering};

use qcbus_bus::Peer;
use qcbus_messages::{FromPeer, Job};

use crate::harness::{Animal, GOOD, Manners, Mood, answer, catalogue};

pub(super) const ANIMAL: Animal = Animal {
    name: "never_the_same",
    manners: Manners {
        welcomed,
        job,
        ..GOOD.manners
    },
    ..GOOD
};

/// Number of changes sent at once.
const CHANGES: u32 = 500;

fn welcomed(peer: &mut Peer) -> Mood {
    for _ in 0..CHANGES {
        change(peer);
    }
    Mood::GoOn
}

fn job(peer: &mut Peer, job: &Job) -> Mood {
    answer(peer, job.job);
    change(peer);
    Mood::GoOn
}

fn change(peer: &mut Peer) {
    static NUMBER: AtomicU64 = AtomicU64::new(0);
    let mut catalogue = catalogue();
    catalogue.build_date = NUMBER.fetch_add(1, Ordering::Relaxed).to_string();
    peer.send(&FromPeer::Catalogue(Box::new(catalogue)));
}

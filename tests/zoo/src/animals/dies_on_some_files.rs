//! Crashes on files with the word [`POISON`] in their name or text. It answers all other jobs
//! correctly.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood, answer};

/// Word that crashes it.
pub const POISON: &str = "poison";

pub(super) const ANIMAL: Animal = Animal {
    name: "dies_on_some_files",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(peer: &mut Peer, job: &Job) -> Mood {
    if is_poison(peer, job) {
        return Mood::Die;
    }
    answer(peer, job.job);
    Mood::GoOn
}

fn is_poison(peer: &Peer, job: &Job) -> bool {
    let contains = |bytes: &[u8]| {
        bytes
            .windows(POISON.len())
            .any(|it| it == POISON.as_bytes())
    };
    job.documents.first().is_some_and(|root| {
        let name = root.path.rsplit('/').next().unwrap_or_default();
        name.contains(POISON)
            || peer
                .document(root.doc)
                .is_some_and(|image| contains(&image))
    })
}

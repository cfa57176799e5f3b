//! Writes into the document image that it was given to read. The image is mapped read-only, so this
//! ends with a segmentation fault in this process. The image does not change.

use qcbus_bus::Peer;
use qcbus_messages::Job;

use crate::harness::{Animal, GOOD, Manners, Mood, answer};

pub(super) const ANIMAL: Animal = Animal {
    name: "writes_to_the_image",
    manners: Manners {
        job,
        ..GOOD.manners
    },
    ..GOOD
};

fn job(peer: &mut Peer, job: &Job) -> Mood {
    let root = job.documents.first();
    if let Some(held) = root.and_then(|root| peer.document(root.doc)) {
        overwrite(&held);
    }
    // This line is reached only if the write succeeded. The test must then fail.
    answer(peer, job.job);
    Mood::GoOn
}

#[expect(unsafe_code, reason = "this animal needs unsafe code")]
fn overwrite(image: &[u8]) {
    let first = image.as_ptr().cast_mut();
    // SAFETY: none is claimed. The memory is mapped without write permission, and the process must
    // die here. A volatile write is not optimised away.
    unsafe { first.write_volatile(0xFF) };
}

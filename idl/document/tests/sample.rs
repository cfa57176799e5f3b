//! Every accessor, on an image so small that an interpreter gets through it: what `.ci/run` gives to
//! miri, which sees reads beyond an image and texts that are none where a test sees nothing.

#![expect(
    clippy::unwrap_used,
    reason = "helpers of tests, which may fail loudly"
)]

use qcbus_document::fuzzing::{self, Outcome, Random, Tree};

/// Spoilt images that are walked.
const SPOILT: u64 = if cfg!(miri) { 6 } else { 2_000 };

fn small() -> Vec<u8> {
    let lane = Tree::new("lane").with("id", "-1").saying("é & b");
    let road = Tree::new("od:road").with("id", "1").with("s", "0.5");
    Tree::new("OpenDRIVE")
        .holding(road.holding(lane))
        .image("a.xodr")
        .unwrap()
}

#[test]
fn a_small_image_is_read_in_every_way() {
    let sound = small();
    assert_eq!(fuzzing::read_image(&sound), Outcome::Sound);
    for seed in 0..SPOILT {
        let mut image = sound.clone();
        fuzzing::corrupt(&mut image, &mut Random(seed));
        fuzzing::read_image(&image);
    }
}

//! Tests of every accessor, on an image that is small enough for an interpreter. `.ci/run` runs
//! them in miri, which detects reads beyond an image and invalid texts that a normal test cannot
//! see.

#![expect(clippy::unwrap_used, reason = "test helpers may panic")]

use qcbus_fuzzing::{Outcome, Random, Tree};

/// Number of corrupted images that are walked.
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
fn corrupted_small_image_is_read_safely() {
    let sound = small();
    assert_eq!(qcbus_fuzzing::read_image(&sound), Outcome::Sound);
    for seed in 0..SPOILT {
        let mut image = sound.clone();
        qcbus_fuzzing::corrupt(&mut image, &mut Random(seed));
        qcbus_fuzzing::read_image(&image);
    }
}

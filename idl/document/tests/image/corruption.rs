//! Tests with invalid or corrupted images. They must be rejected or walked, and must never cause a
//! panic.

use qcbus_fuzzing::{Outcome, Random, Tree};

/// Returns the number of rounds. They are seeded, so that a failure can be repeated.
/// `QCBUS_FUZZ_ROUNDS` sets a larger number than that of CI.
fn rounds(default: u64) -> u64 {
    std::env::var("QCBUS_FUZZ_ROUNDS")
        .ok()
        .and_then(|rounds| rounds.parse().ok())
        .unwrap_or(default)
}

fn road_network() -> Tree {
    let mut root = Tree::new("OpenDRIVE").with("xmlns:xsi", "http://example.org/xsi");
    for id in 0..4 {
        let id = id.to_string();
        let lane = Tree::new("lane")
            .with("id", "-1")
            .saying("sidewalk & kerb")
            .holding(Tree::new("width").with("a", "3.5"));
        let road = Tree::new("road")
            .with("id", &id)
            .with("name", "a <b>")
            .with("length", "12,5");
        root = root.holding(road.holding(Tree::new("lanes").holding(lane.clone()).holding(lane)));
    }
    root
}

#[test]
fn corrupted_image_is_refused_or_walked_safely() {
    let sound = road_network().image("maps/straight.xodr").unwrap();
    assert_eq!(qcbus_fuzzing::read_image(&sound), Outcome::Sound);
    let (mut refused, mut contradictory, mut still_sound) = (0, 0, 0);
    for seed in 0..rounds(4_000) {
        let mut image = sound.clone();
        qcbus_fuzzing::corrupt(&mut image, &mut Random(seed));
        match qcbus_fuzzing::read_image(&image) {
            Outcome::Refused => refused += 1,
            Outcome::Contradictory => contradictory += 1,
            // Values, padding and the content hash may change without a contradiction.
            Outcome::Sound => still_sound += 1,
        }
    }
    println!("{refused} refused, {contradictory} contradictory, {still_sound} still sound");
    assert!(refused > 0 && contradictory > 0 && still_sound > 0);
}

#[test]
fn any_event_order_is_refused_or_gives_sound_image() {
    let mut built = 0;
    for seed in 0..rounds(4_000) {
        let mut random = Random(seed);
        let script: Vec<u8> = (0..300).map(|_| random.number() as u8).collect();
        built +=
            u32::from(qcbus_fuzzing::build_image(&script).is_ok_and(|image| image.len() > 700));
    }
    assert!(
        built > 100,
        "only {built} scripts built an image of sufficient size"
    );
}

#[test]
fn every_prefix_of_an_image_is_refused() {
    let sound = road_network().image("maps/straight.xodr").unwrap();
    for len in 0..sound.len() {
        assert_eq!(
            qcbus_fuzzing::read_image(&sound[..len]),
            Outcome::Refused,
            "{len} bytes"
        );
    }
}

#[test]
fn image_is_read_at_any_address_in_longer_buffer() {
    let sound = road_network().image("maps/straight.xodr").unwrap();
    for shift in 1..9 {
        let mut buffer = vec![0xEE; shift];
        buffer.extend_from_slice(&sound);
        buffer.extend_from_slice(&[0xEE; 100]);
        assert_eq!(
            qcbus_fuzzing::read_image(&buffer[shift..]),
            Outcome::Sound,
            "shifted by {shift}"
        );
    }
}

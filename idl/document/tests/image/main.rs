//! Tests of images: positions, round trips, corrupted bytes.

#![expect(clippy::unwrap_used, reason = "a test that cannot continue panics")]

mod corruption;
mod places;
mod round_trip;

//! The misbehaving bundles and reporters ("animals"), one per file.

mod allocates_forever;
mod dies_on_every_job;
mod dies_on_some_files;
mod floods_issues;
mod floods_metadata;
mod floods_with_huge_messages;
mod hangs_after_hello;
mod hangs_in_a_job;
mod judges_strictly;
mod lies_about_job_id;
mod meddles;
mod never_acknowledges;
mod never_the_same;
mod proves_nothing;
mod reporter_never_acknowledges;
mod scribbles_on_others;
mod sends_garbage;
mod slow;
mod speaks_another_protocol;
mod speaks_in_lines;
mod stops_reading;
mod writes_to_the_image;

pub use dies_on_some_files::POISON;
pub use judges_strictly::MARK;
pub use speaks_another_protocol::PROTOCOL as ANOTHER_PROTOCOL;

use crate::harness::Animal;

/// All animals except the polite one, which is a real bundle.
pub static ANIMALS: &[Animal] = &[
    allocates_forever::ANIMAL,
    dies_on_every_job::ANIMAL,
    dies_on_some_files::ANIMAL,
    floods_issues::ANIMAL,
    floods_metadata::ANIMAL,
    floods_with_huge_messages::ANIMAL,
    hangs_after_hello::ANIMAL,
    hangs_in_a_job::ANIMAL,
    judges_strictly::ANIMAL,
    lies_about_job_id::ANIMAL,
    meddles::ANIMAL,
    never_acknowledges::ANIMAL,
    never_the_same::ANIMAL,
    proves_nothing::ANIMAL,
    reporter_never_acknowledges::ANIMAL,
    scribbles_on_others::ANIMAL,
    sends_garbage::ANIMAL,
    slow::ANIMAL,
    speaks_another_protocol::ANIMAL,
    speaks_in_lines::ANIMAL,
    stops_reading::ANIMAL,
    writes_to_the_image::ANIMAL,
];

/// Returns the animal of this name.
pub fn named(name: &str) -> Option<&'static Animal> {
    ANIMALS.iter().find(|animal| animal.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn animal_names_are_unique_and_valid_on_the_bus() {
        for (at, animal) in ANIMALS.iter().enumerate() {
            assert!(
                ANIMALS[at + 1..]
                    .iter()
                    .all(|other| other.name != animal.name)
            );
            assert!(
                animal
                    .name
                    .chars()
                    .all(|c| c.is_ascii_lowercase() || c == '_')
            );
        }
    }
}

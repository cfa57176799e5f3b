//! The zoo: small programs ("animals") that misbehave on the bus as bundles or reporters, each
//! under an honest name. One of them behaves correctly. Tests of the broker run them.
//!
//! Each animal is one file in `animals/`; [`animals::ANIMALS`] is the list. Their common code is in
//! `harness`: joining the bus, the loop, and the answer to a job if there is one.

pub mod animals;
mod args;
mod harness;
mod polite;

use std::process::ExitCode;

pub use args::{Args, USAGE};
pub use harness::{Animal, Manners, Mood};

/// Runs the animal that the arguments name.
pub fn main(arguments: impl Iterator<Item = String>) -> ExitCode {
    let args = match Args::parse(arguments) {
        Ok(args) => args,
        Err(why) => {
            complain(&format!("{why}\n\n{USAGE}"));
            return ExitCode::from(2);
        }
    };
    if args.animal == polite::NAME {
        return polite::run(args);
    }
    match animals::named(&args.animal) {
        Some(animal) => harness::run(animal, &args),
        None => {
            let known: Vec<&str> = animals::ANIMALS.iter().map(|it| it.name).collect();
            complain(&format!(
                "no animal is called `{}`; there are {}, {}",
                args.animal,
                polite::NAME,
                known.join(", ")
            ));
            ExitCode::from(2)
        }
    }
}

#[expect(
    clippy::print_stderr,
    reason = "only this function prints the messages of the zoo"
)]
fn complain(text: &str) {
    eprintln!("zoo: {text}");
}

//! Measures the time of the expansion of a modular scenario in this process.
//!
//!     cargo bench -p qcbus-modular --bench expansion_speed -- $PWD/FILE…
//!
//! Prints, for each file, the median of 201 runs in microseconds. The times cover reading the file
//! with all its dependencies (including its expanded image), expanding its documents, and writing
//! the expanded text.

#![expect(clippy::print_stdout, reason = "it prints what it measured")]

use std::path::Path;
use std::time::{Duration, Instant};

use qcbus_modular::BUNDLE;
use qcbus_sdk::{LoadError, Loaded};

const RUNS: usize = 201;

fn median(mut run: impl FnMut()) -> u128 {
    let mut times: Vec<Duration> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            run();
            start.elapsed()
        })
        .collect();
    times.sort_unstable();
    times.get(RUNS / 2).map_or(0, Duration::as_micros)
}

fn main() -> Result<(), LoadError> {
    println!("| file | references | load | expand | write |\n|---|--:|--:|--:|--:|");
    let is_file = |argument: &String| argument != "--bench"; // cargo adds it
    for argument in std::env::args().skip(1).filter(is_file) {
        let path = Path::new(&argument);
        let folder = path.parent().unwrap_or(Path::new("."));
        let loaded = Loaded::from_path(path, folder)?;
        let load = median(|| drop(Loaded::from_path(path, folder)));
        let subject = loaded.subject(&BUNDLE)?;
        let expand = median(|| drop(subject.expansion()));
        let expansion = subject.expansion();
        let write = median(|| drop(expansion.text()));
        let references = expansion.references.len();
        println!("| {argument} | {references} | {load} µs | {expand} µs | {write} µs |");
    }
    Ok(())
}

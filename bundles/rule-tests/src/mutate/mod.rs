//! Test edits of files as authors and tools make them: lists of edits, and the new findings of a
//! bundle.
//!
//! Edits change the text of a file and nothing else: rows stay the same. The directory of the files
//! is mirrored by links, so that catalogs and maps beside a scenario can be edited, too.

#![expect(
    clippy::unwrap_used,
    reason = "a test may panic and report what it tried"
)]

mod change;
mod edit;
mod encode;
mod overlay;
mod said;
mod scan;
pub mod seeded;
mod select;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};

pub use change::{Changed, Edit, Rows, Spots, Target, apply, beside};
pub use edit::{Action, Edited};
pub use overlay::Overlay;
pub use said::{Said, name, new_ones, said};
pub use scan::{Attribute, Element, Scan};
pub use select::Selector;

/// Processes every item, on all processors. Each thread has a state of its own. The results are in
/// the items' order.
///
/// # Panics
/// Panics if the work panics.
pub fn in_parallel<D: Default, T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&mut D, &T) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let worker = || {
        let (mut state, mut done) = (D::default(), Vec::new());
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(at) else {
                return done;
            };
            done.push((at, work(&mut state, item)));
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let done: BTreeMap<usize, R> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        let all = workers.into_iter().flat_map(|it| it.join().unwrap());
        all.collect()
    });
    done.into_values().collect()
}

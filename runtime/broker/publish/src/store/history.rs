//! History of a verdict for the journal.

use qcbus_formats::pool::Pooled;
use qcbus_formats::xqar::Status;
use qcbus_types::FinishedJob;

use crate::journal::History;

/// Returns the statistics of each bundle, and the checkers that failed, have findings or were skipped.
pub(super) fn history(job: &FinishedJob, pooled: &Pooled) -> History {
    let bundles = job.bundles.iter().map(|it| {
        (
            it.name.clone(),
            it.version.clone(),
            it.micros,
            it.failure.clone().unwrap_or_default(),
        )
    });
    let (mut checkers, mut skipped) = (Vec::new(), Vec::new());
    for bundle in &pooled.results.bundles {
        let mut left_out = Vec::new();
        for checker in &bundle.checkers {
            let issues = checker.issues.len() as u64;
            match checker.status.unwrap_or(Status::Error) {
                Status::Completed if issues == 0 => {}
                Status::Skipped if issues == 0 => left_out.push(checker.id.clone()),
                status => {
                    let (bundle, checker) = (bundle.name.clone(), checker.id.to_string());
                    checkers.push((bundle, checker, status.as_str().to_owned(), issues));
                }
            }
        }
        if !left_out.is_empty() {
            skipped.push((bundle.name.clone(), left_out));
        }
    }
    History {
        bytes: job.prepared.as_ref().map_or(0, |it| it.bytes),
        micros: u64::try_from(job.elapsed.as_micros()).unwrap_or(u64::MAX),
        bundles: bundles.collect(),
        checkers,
        skipped,
    }
}

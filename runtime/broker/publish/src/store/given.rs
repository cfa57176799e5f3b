//! Results of a run of `check` that were found by a broker.

use std::path::Path;
use std::sync::Arc;

use qcbus_disk::write_whole;
use qcbus_messages::control::Checked;
use qcbus_messages::{Digest, JobId, Verdict};
use qcbus_types::{Epoch, Judged, RequiredSet};

use super::{remove_earlier_results, unwritten};
use crate::directory_lock::{DirectoryLock, LockError};
use crate::result_paths::ResultPaths;

/// Stores the results that another broker has found for a run.
#[derive(Debug)]
pub struct GivenResults {
    places: ResultPaths,
    config: Digest,
    /// Lock that excludes brokers from writing results there.
    _results: DirectoryLock,
}

impl GivenResults {
    /// Prepares the directory for the results of a run and removes those of earlier runs. Returns
    /// messages for the user about results that cannot be removed. `config` is the digest of the
    /// configuration of the run.
    ///
    /// # Errors
    /// When the directory belongs to another user or broker, or cannot be written to.
    pub fn open(
        places: ResultPaths,
        config: Digest,
    ) -> Result<(GivenResults, Vec<String>), LockError> {
        let results = DirectoryLock::share(&places.out)?;
        let left = remove_earlier_results(&places);
        let given = GivenResults {
            places,
            config,
            _results: results,
        };
        Ok((given, left))
    }

    /// Writes the result of a file. If this fails, the file becomes undetermined.
    pub fn keep(&self, file: &Path, checked: Checked) -> Arc<Judged> {
        let told = checked.verdict;
        let xqar = self.places.xqar(file);
        let written = write_whole(&xqar, checked.result.as_bytes(), false);
        let mut judged = Judged {
            job: JobId(0),
            verdict: told.verdict,
            own: told.verdict,
            own_errors: told.errors,
            rests_on: Some(Vec::new()),
            digest: told.digest.parse().unwrap_or_default(),
            basis: Digest::default(),
            config: self.config,
            required_set: Arc::new(RequiredSet::default()),
            epoch: Epoch::default(),
            inputs: Vec::new(),
            racy: true,
            counts: [told.errors, told.warnings, told.information],
            why: told.why,
            xqar: Some(xqar.clone()),
        };
        if let Err(error) = written {
            judged.verdict = Verdict::Undetermined;
            judged.why.insert(0, unwritten(&xqar, &error).what);
            judged.xqar = None;
        }
        Arc::new(judged)
    }
}

//! Results of shadows: pooled like any other result, but stored next to the journal.

use std::io;
use std::path::{Path, PathBuf};

use qcbus_disk::write_whole;
use qcbus_formats::config::Config;
use qcbus_formats::pool::Scope;
use qcbus_formats::xqar::{self, CheckerBundle, Level};
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use qcbus_types::{FinishedJob, OnDemandOutcome, TrialEnd};
use sha2::{Digest as _, Sha256};

use super::Store;

/// Name of the directory below the state directory.
const DIRECTORY: &str = "shadow";

/// Maximum number of reasons kept of one trial.
const REASONS: usize = 3;

/// Maximum number of bytes of a file's name in the name of its result.
const MOST_OF_A_NAME: usize = 128;

/// Directory of the results of trials.
#[derive(Debug, Clone)]
pub struct TrialResults(PathBuf);

impl TrialResults {
    /// Creates an empty directory for a broker with this state directory. Every file is tried again.
    pub fn anew(state: &Path) -> TrialResults {
        let directory = state.join(DIRECTORY);
        // A result that cannot be removed is overwritten, or no longer referenced.
        let _ = std::fs::remove_dir_all(&directory);
        TrialResults(directory)
    }

    /// Returns the path of the result for one file. It contains the file's name and a digest of its path.
    fn of(&self, shadow: &str, file: &Path) -> PathBuf {
        let digest = Sha256::digest(file.as_os_str().as_encoded_bytes());
        let number = digest.iter().take(4).map(|byte| format!("{byte:02x}"));
        let number: String = number.collect();
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let mut end = name.len().min(MOST_OF_A_NAME);
        while !name.is_char_boundary(end) {
            end -= 1;
        }
        let name = format!("{}-{number}.xqar", &name[..end]);
        self.0.join(shadow).join(name)
    }

    /// Removes the results of a shadow for one file, or for all files.
    pub fn forget(&self, shadow: &str, file: Option<&Path>) {
        // A missing result need not be removed, and one that cannot be removed is overwritten later.
        let _ = match file {
            Some(file) => std::fs::remove_file(self.of(shadow, file)),
            None => std::fs::remove_dir_all(self.0.join(shadow)),
        };
    }
}

impl Store {
    /// Pools the findings of a shadow, and stores its result if it has findings.
    pub fn pool_trial(
        &self,
        shadow: &str,
        job: &mut FinishedJob,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> OnDemandOutcome {
        let pooled = match self.pool_as_it_is(job, (config, Scope::Alone), root) {
            Ok(pooled) => pooled,
            Err(outcome) => return outcome,
        };
        let mut bundles = pooled.results.bundles.iter();
        let its_own = bundles.find(|it| it.name == shadow);
        let adds = its_own.map_or(Verdict::Accepted, Verdict::added_by);
        let open = pooled.open().filter(|it| it.bundle == shadow);
        let mut found = TrialEnd {
            adds,
            alone: pooled.verdict(),
            counts: its_own.map(counts).unwrap_or_default(),
            why: open.take(REASONS).map(ToString::to_string).collect(),
            result: None,
        };
        let is_silent = adds == Verdict::Accepted && found.counts == [0; 3];
        let (Some(results), false) = (&self.trials, is_silent) else {
            if let Some(results) = &self.trials {
                results.forget(shadow, Some(&job.path));
            }
            return OnDemandOutcome::Tried(found);
        };
        let path = results.of(shadow, &job.path);
        let text = xqar::write(&pooled.results, self.dialect);
        match write_whole(&path, text.as_bytes(), false) {
            Ok(()) => found.result = Some(path),
            Err(error) => return OnDemandOutcome::Failed(unkept(&path, &error)),
        }
        OnDemandOutcome::Tried(found)
    }
}

/// Returns the numbers of issues: errors, warnings, information.
fn counts(bundle: &CheckerBundle) -> [u64; 3] {
    let issues = bundle.checkers.iter().flat_map(|it| &it.issues);
    let mut counts = [0; 3];
    for issue in issues {
        let at = match issue.level {
            Level::Error => 0,
            Level::Warning => 1,
            Level::Information => 2,
        };
        counts[at] += 1;
    }
    counts
}

fn unkept(path: &Path, error: &io::Error) -> String {
    format!("cannot write {}: {error}", to_text(path))
}

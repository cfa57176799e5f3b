//! From outcomes to files on disk: pooling, the result, the verdict file, the gate.

mod earlier;
mod given;
mod history;
mod leftovers;
mod on_demand;
mod pooling;
mod reconcile;
mod refresh;
mod trial;
mod withdraw;
mod writing;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use qcbus_disk::is_for_good;
use qcbus_environment::{disk, reached, step};
use qcbus_formats::config::{Choice, Config};
use qcbus_formats::pool::{BundleOutcome, Pooled, Scope};
use qcbus_formats::xqar::{Dialect, Level};
use qcbus_ingest::RESTS_ON_CHECKER;
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;
use qcbus_types::{FinishedJob, Judged, StoreOutcome, TaskOutcome};
use qcbus_watch::probes::Probes;
use qcbus_watch::stamp::stamp_of;

use crate::directory_lock::DirectoryLock;
use crate::gate::Gate;
use crate::journal::{Entry, JournalError, Remembered, SharedJournal};
use crate::outputs::Outputs;
use crate::result_paths::ResultPaths;

pub use earlier::remove_earlier_results;
pub use given::GivenResults;
use pooling::reasons;
pub use reconcile::Reconciled;
use refresh::refreshed;
pub use trial::TrialResults;

/// Writes results. The writer threads share it.
#[derive(Debug)]
pub struct Store {
    /// Paths of the results.
    pub places: ResultPaths,
    /// Selection among the demanded checkers.
    pub choice: Choice,
    /// Whether findings have the levels of ASAM, whatever the configuration says.
    pub strict: bool,
    /// Whether findings about one fault stay separate issues.
    pub all: bool,
    /// Dialect of the results.
    pub dialect: Dialect,
    /// Whether results are flushed to the disk before they are announced.
    pub durable: bool,
    /// Whether `NAME.verdict.json` is written.
    pub verdict_files: bool,
    /// Whether a failed write is tried again.
    pub retries: bool,
    /// Whether the verdict on a file is independent of its dependencies.
    pub own_verdicts: bool,
    /// Gate that publishes accepted files.
    pub gate: Option<Gate>,
    /// Monitors the written files.
    pub outputs: Outputs,
    /// Lock that excludes other brokers from writing results there.
    pub lock: DirectoryLock,
    /// Probe threads that access files.
    pub probes: Probes,
    /// Directory for results of trials, if they are kept.
    pub trials: Option<TrialResults>,
    /// Journal. A single run has none, because its state is not needed later.
    pub journal: Option<SharedJournal>,
    /// Current epoch of the required set. A verdict from an earlier epoch is not stored.
    pub epoch: AtomicU64,
}

impl Store {
    /// Pools the findings, writes the result, publishes the file and records the verdict.
    pub fn store(
        &self,
        job: &mut FinishedJob,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> StoreOutcome {
        step("storing", &job.path);
        match self.refresh(job) {
            Ok(true) => {}
            Ok(false) => {
                return StoreOutcome::Stale {
                    half_written: false,
                };
            }
            Err(error) => return StoreOutcome::Failed(unlooked(&job.path, &error)),
        }
        let outcomes: Vec<BundleOutcome> = job.bundles.iter().map(TaskOutcome::said).collect();
        let pooled = self.pool(job, outcomes, (config, Scope::Whole), root);
        reached("pooled", &job.path);
        let verdict = pooled.verdict();
        let why = reasons(job, &pooled, verdict);
        let judged = judged(job, &pooled, verdict, why, self.places.xqar(&job.path));
        // This check is as late as possible: after it the verdict becomes visible to others.
        if self.epoch.load(Ordering::Acquire) != job.epoch.0 {
            return StoreOutcome::Outdated;
        }
        if let Err(failed) = self.write(job, &pooled, &judged) {
            return self.not_written(job, judged, failed);
        }
        step("recorded", &job.path);
        // The file may have been removed between the check and the rename. In that case no result may stay.
        if self.has_gone(&job.path) {
            let _ = self.withdraw_files(&job.path);
            return StoreOutcome::Stale {
                half_written: false,
            };
        }
        StoreOutcome::Stored(Box::new(judged))
    }

    /// Returns the outcome of a failed write. If the result can never be written, the file becomes undetermined: a
    /// missing result must not count as an acceptance, and no process should wait for it.
    fn not_written(
        &self,
        job: &mut FinishedJob,
        mut judged: Judged,
        failed: Unwritten,
    ) -> StoreOutcome {
        if matches!(self.refresh(job), Ok(false)) {
            return StoreOutcome::Stale { half_written: true };
        }
        if self.retries && !failed.for_good {
            return StoreOutcome::Failed(failed.what + failed.further);
        }
        // A failure here is ignored. The existing result does not belong to these bytes.
        let _ = self.withdraw(&job.path, &[]);
        judged.verdict = Verdict::Undetermined;
        judged.why.insert(0, failed.what);
        judged.xqar = None;
        StoreOutcome::Stored(Box::new(judged))
    }

    /// Checks whether all inputs of the verdict are unchanged since they were read. A changed stamp
    /// with the same bytes (another link to the file, other permissions) is stored.
    ///
    /// # Errors
    /// When the system does not answer.
    fn refresh(&self, job: &mut FinishedJob) -> io::Result<bool> {
        let Some(prepared) = &mut job.prepared else {
            return Ok(true);
        };
        let read = prepared.clone();
        let now = move || refreshed(&read.inputs);
        let Some(now) = self.probes.within(now)? else {
            return Ok(false);
        };
        if let Some(moved) = now {
            let prepared = Arc::make_mut(prepared);
            prepared.inputs = moved;
            // The stamps changed just now, and may change again without a visible difference.
            prepared.racy = true;
        }
        Ok(true)
    }

    /// Checks whether a file certainly no longer exists. Without an answer of the system it exists.
    fn has_gone(&self, path: &Arc<Path>) -> bool {
        let path = path.clone();
        let stamp = self.probes.within(move || stamp_of(&path));
        matches!(stamp, Ok(Ok(None)))
    }

    /// Publishes a file again, because its verdict still holds or got new stamps.
    ///
    /// # Errors
    /// A message for the user. The action must be tried again.
    pub fn open_gate(&self, path: &Arc<Path>, judged: &Judged) -> Result<(), StoreFailure> {
        match self.gate.as_ref().filter(|_| judged.is_accepted()) {
            None => Ok(()),
            Some(gate) => gate
                .accept(path, judged)
                .map_err(|error| StoreFailure::not_published(path, &error)),
        }
    }

    /// Removes a file from behind the gate with everything that depends on it.
    ///
    /// # Errors
    /// A message for the user. The action must be tried again.
    pub fn close_gate(&self, path: &Arc<Path>) -> Result<(), StoreFailure> {
        let revoked = self.gate.as_ref().map_or(Ok(()), |gate| gate.revoke(path));
        revoked.map_err(|error| StoreFailure {
            what: format!("cannot remove {} from the gate: {error}", to_text(path)),
            concerns_all: false,
        })
    }

    /// Publishes an accepted file if it is not published yet, and the files that waited for it.
    ///
    /// # Errors
    /// A message for the user. The action must be tried again.
    pub fn follow(&self, path: &Arc<Path>) -> Result<(), StoreFailure> {
        let followed = self.gate.as_ref().map_or(Ok(()), |gate| gate.follow(path));
        followed.map_err(|(path, error)| StoreFailure::not_published(&path, &error))
    }

    /// Writes to the journal.
    ///
    /// # Errors
    /// A message for the user. The entries are not written then.
    pub fn record(&self, entries: &[Entry]) -> Result<(), String> {
        disk().map_err(|error| format!("the journal cannot be written: {error}"))?;
        let Some(journal) = &self.journal else {
            return Ok(());
        };
        let noted = journal.note(entries);
        if let Some(path) = entries.first().and_then(Entry::path) {
            step("noted", path);
        }
        journal.settle(&noted)
    }

    /// Returns all files in the journal.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn remembered(&self) -> Result<Vec<Remembered>, JournalError> {
        let journal = self.journal.as_ref();
        journal.map_or(Ok(Vec::new()), |it| it.get().remembered())
    }

    /// Deletes the history of jobs older than `keep`.
    ///
    /// # Errors
    /// A message for the user.
    pub fn prune(&self, keep: std::time::Duration) -> Result<(), String> {
        let Some(journal) = &self.journal else {
            return Ok(());
        };
        let pruned = journal.get().prune(keep);
        pruned.map(|_| ()).map_err(|error| error.to_string())
    }
}

/// Failure of an action that must be tried again.
#[derive(Debug)]
pub struct StoreFailure {
    /// Message for the user.
    pub what: String,
    /// Whether the failure is not about one file, because the journal cannot be written.
    pub concerns_all: bool,
}

impl StoreFailure {
    fn not_published(path: &Path, error: &io::Error) -> StoreFailure {
        StoreFailure {
            what: format!("cannot publish {}: {error}", to_text(path)),
            concerns_all: false,
        }
    }

    /// Returns the failure to write the journal.
    pub fn of_all(what: String) -> StoreFailure {
        StoreFailure {
            what,
            concerns_all: true,
        }
    }
}

fn unlooked(path: &Path, error: &io::Error) -> String {
    let path = to_text(path);
    format!("cannot tell whether {path} has changed since it was checked: {error}; it is retried")
}

/// Reason why a result is missing.
struct Unwritten {
    /// Message for the user.
    what: String,
    /// Additional text if the write is tried again.
    further: &'static str,
    /// Whether waiting does not help.
    for_good: bool,
}

fn unwritten(path: &Path, error: &io::Error) -> Unwritten {
    Unwritten {
        what: format!("cannot write {}: {error}", to_text(path)),
        further: "; it is retried",
        for_good: is_for_good(error),
    }
}

fn judged(
    job: &FinishedJob,
    pooled: &Pooled,
    verdict: Verdict,
    why: Vec<String>,
    xqar: PathBuf,
) -> Judged {
    let prepared = job.prepared.as_deref();
    let root = prepared.and_then(qcbus_types::PreparedJob::root);
    // Findings about files that it depends on are not its own errors.
    let of_others = pooled.results.bundles.iter().flat_map(|it| &it.checkers);
    let of_others = of_others.filter(|it| &*it.id == RESTS_ON_CHECKER);
    let of_others = of_others.flat_map(|it| &it.issues);
    let of_others = of_others.filter(|it| it.level == Level::Error).count() as u64;
    let rests_on = job.rests_on.iter().map(|(_, it)| it.clone());
    Judged {
        job: job.job,
        verdict,
        own: pooled.verdict_without(RESTS_ON_CHECKER),
        own_errors: pooled.counts.errors.saturating_sub(of_others),
        rests_on: Some(rests_on.collect()),
        digest: root.map(|(_, digest)| digest).unwrap_or_default(),
        basis: prepared.map(|it| it.basis).unwrap_or_default(),
        config: job.config,
        required_set: job.required_set.clone(),
        epoch: job.epoch,
        inputs: prepared.map(|it| it.inputs.clone()).unwrap_or_default(),
        racy: prepared.is_none_or(|it| it.racy),
        counts: [
            pooled.counts.errors,
            pooled.counts.warnings,
            pooled.counts.information,
        ],
        why,
        xqar: Some(xqar),
    }
}

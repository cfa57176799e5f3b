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

use qcbus_formats::config::{Choice, Config};
use qcbus_formats::pool::{BundleOutcome, Pooled, Scope};
use qcbus_formats::xqar::{Dialect, Level};
use qcbus_ingest::RESTS_ON_CHECKER;
use qcbus_messages::Verdict;
use qcbus_messages::path_text::to_text;

use crate::core::{FinishedJob, Judged, StoreOutcome, TaskOutcome};
use crate::directory_lock::DirectoryLock;
use crate::environment::{disk, step};
use crate::gate::Gate;
use crate::journal::{Entry, JournalError, Remembered, SharedJournal};
use crate::outputs::Outputs;
use crate::probes::Probes;
use crate::result_paths::ResultPaths;
use crate::stages::reached;
use crate::stamp::stamp_of;
use qcbus_disk::is_for_good;

pub use earlier::remove_earlier_results;
pub use given::GivenResults;
use pooling::reasons;
pub use reconcile::Reconciled;
pub use refresh::digest_of;
use refresh::refreshed;
pub use trial::TrialResults;

/// Writes results. Shared by the threads that do so.
#[derive(Debug)]
pub struct Store {
    /// Where results go.
    pub places: ResultPaths,
    /// What of all that would be demanded is asked for.
    pub choice: Choice,
    /// The form of the results.
    pub dialect: Dialect,
    /// Whether results are on the disk before they are announced.
    pub durable: bool,
    /// Whether `NAME.verdict.json` is written.
    pub verdict_files: bool,
    /// Whether what cannot be written now is tried again.
    pub retries: bool,
    /// Whether the verdict on a file is its own, whatever it rests on.
    pub own_verdicts: bool,
    /// Where accepted files are published.
    pub gate: Option<Gate>,
    /// Keeps what is written.
    pub outputs: Outputs,
    /// Nobody else writes results there.
    pub lock: DirectoryLock,
    /// Who looks at files.
    pub probes: Probes,
    /// Where results of trials are kept, if anything is.
    pub trials: Option<TrialResults>,
    /// What is remembered; without it, nothing is: of a single run nobody asks later.
    pub journal: Option<SharedJournal>,
    /// The epoch of who must judge: what was judged in an earlier one is not stored.
    pub epoch: AtomicU64,
}

impl Store {
    /// Pools, writes, publishes, records.
    pub fn store(
        &self,
        job: &mut FinishedJob,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> StoreOutcome {
        step("storing", &job.path);
        match self.refresh(job) {
            Ok(true) => {}
            Ok(false) => return StoreOutcome::Stale,
            Err(error) => return StoreOutcome::Failed(unlooked(&job.path, &error)),
        }
        let outcomes: Vec<BundleOutcome> = job.bundles.iter().map(TaskOutcome::said).collect();
        let pooled = self.pool(job, outcomes, (config, Scope::Whole), root);
        reached("pooled", &job.path);
        let verdict = pooled.verdict();
        let why = reasons(job, &pooled, verdict);
        let judged = judged(job, &pooled, verdict, why, self.places.xqar(&job.path));
        // At the last moment: from here on a verdict is on its way to where others see it.
        if self.epoch.load(Ordering::Acquire) != job.epoch.0 {
            return StoreOutcome::Outdated;
        }
        if let Err(failed) = self.write(job, &pooled, &judged) {
            return self.not_written(job, judged, failed);
        }
        step("recorded", &job.path);
        // The file may have gone between the look and the rename: nothing may lie there then.
        if self.has_gone(&job.path) {
            let _ = self.withdraw_files(&job.path);
            return StoreOutcome::Stale;
        }
        StoreOutcome::Stored(Box::new(judged))
    }

    /// A result that can never be written leaves its file undetermined: nobody may take what is
    /// not there for an acceptance, and nobody should wait for it.
    fn not_written(
        &self,
        job: &mut FinishedJob,
        mut judged: Judged,
        failed: Unwritten,
    ) -> StoreOutcome {
        if matches!(self.refresh(job), Ok(false)) {
            return StoreOutcome::Stale;
        }
        if self.retries && !failed.for_good {
            return StoreOutcome::Failed(failed.what + failed.further);
        }
        // As far as it goes: what lies there is not of these bytes.
        let _ = self.withdraw(&job.path, &[]);
        judged.verdict = Verdict::Undetermined;
        judged.why.insert(0, failed.what);
        judged.xqar = None;
        StoreOutcome::Stored(Box::new(judged))
    }

    /// Whether everything that the verdict depends on is what it was when it was read. Stamps that
    /// moved although the bytes are the same (another link to the file, other rights) are taken over.
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
            // They moved a moment ago, and may move again without telling.
            prepared.racy = true;
        }
        Ok(true)
    }

    /// Whether a file certainly is no more. One that does not answer is there.
    fn has_gone(&self, path: &Arc<Path>) -> bool {
        let path = path.clone();
        let stamp = self.probes.within(move || stamp_of(&path));
        matches!(stamp, Ok(Ok(None)))
    }

    /// The verdict stands after all, or got fresh stamps: the file lies behind the gate again.
    ///
    /// # Errors
    /// What a person should know; it is to be tried again.
    pub fn open_gate(&self, path: &Arc<Path>, judged: &Judged) -> Result<(), StoreFailure> {
        match self.gate.as_ref().filter(|_| judged.is_accepted()) {
            None => Ok(()),
            Some(gate) => gate
                .accept(path, judged)
                .map_err(|error| StoreFailure::not_published(path, &error)),
        }
    }

    /// The file goes from behind the gate with everything that rests on it.
    ///
    /// # Errors
    /// What a person should know; it is to be tried again.
    pub fn close_gate(&self, path: &Arc<Path>) -> Result<(), StoreFailure> {
        let revoked = self.gate.as_ref().map_or(Ok(()), |gate| gate.revoke(path));
        revoked.map_err(|error| StoreFailure {
            what: format!("cannot take {} from the gate: {error}", to_text(path)),
            concerns_all: false,
        })
    }

    /// Publishes an accepted file if that has not been done, and what waited for it.
    ///
    /// # Errors
    /// What a person should know; it is to be tried again.
    pub fn follow(&self, path: &Arc<Path>) -> Result<(), StoreFailure> {
        let followed = self.gate.as_ref().map_or(Ok(()), |gate| gate.follow(path));
        followed.map_err(|(path, error)| StoreFailure::not_published(&path, &error))
    }

    /// Writes to the journal.
    ///
    /// # Errors
    /// What a person should know; the entries are not written then.
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

    /// Everything that is remembered of files.
    ///
    /// # Errors
    /// When the journal cannot be read.
    pub fn remembered(&self) -> Result<Vec<Remembered>, JournalError> {
        let journal = self.journal.as_ref();
        journal.map_or(Ok(Vec::new()), |it| it.get().remembered())
    }

    /// Forgets the history of jobs older than `keep`.
    ///
    /// # Errors
    /// What a person should know.
    pub fn prune(&self, keep: std::time::Duration) -> Result<(), String> {
        let Some(journal) = &self.journal else {
            return Ok(());
        };
        let pruned = journal.get().prune(keep);
        pruned.map(|_| ()).map_err(|error| error.to_string())
    }
}

/// Why something that is to be tried again could not be done.
#[derive(Debug)]
pub struct StoreFailure {
    /// For a person.
    pub what: String,
    /// It is not about one file: the journal cannot be written.
    pub concerns_all: bool,
}

impl StoreFailure {
    fn not_published(path: &Path, error: &io::Error) -> StoreFailure {
        StoreFailure {
            what: format!("cannot publish {}: {error}", to_text(path)),
            concerns_all: false,
        }
    }

    /// The journal cannot be written.
    pub fn of_all(what: String) -> StoreFailure {
        StoreFailure {
            what,
            concerns_all: true,
        }
    }
}

fn unlooked(path: &Path, error: &io::Error) -> String {
    let path = to_text(path);
    format!("cannot tell whether {path} is still what was checked: {error}; it is tried again")
}

/// Why a result is not there.
struct Unwritten {
    /// For a person.
    what: String,
    /// What is said besides when it is tried again.
    further: &'static str,
    /// No waiting helps.
    for_good: bool,
}

fn unwritten(path: &Path, error: &io::Error) -> Unwritten {
    Unwritten {
        what: format!("cannot write {}: {error}", to_text(path)),
        further: "; it is tried again",
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
    let root = prepared.and_then(crate::core::PreparedJob::root);
    // What is said of the files that it rests on is no fault of its own.
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

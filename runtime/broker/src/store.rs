//! From outcomes to files on disk: pooling, the result, the verdict file, the gate.

use std::collections::HashMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};

use qcbus_document::Document;
use qcbus_formats::config::Config;
use qcbus_formats::pool::{
    self, BundleOutcome, Ending, NoPlaces, PoolInput, Pooled, Remark, Resolver, Scope, Unfinished,
};
use qcbus_formats::xqar::{self, Dialect, Status};
use qcbus_messages::path_text::to_text;
use qcbus_messages::{BUILD_DATE, Digest, Verdict};

use crate::core::{FinishedJob, Input, Judged, ShareOutcome, StoreOutcome};
use crate::disk::{is_for_good, remove, write_both, write_whole};
use crate::journal::{Entry, History, Journal};
use crate::result_paths::{ResultPaths, with_suffix};
use crate::stages::reached;
use crate::stamp::stamp_through_links;

/// Writes results. Shared by the threads that do so.
#[derive(Debug)]
pub struct Store {
    /// Where results go.
    pub places: ResultPaths,
    /// The form of the results.
    pub dialect: Dialect,
    /// Whether results are on the disk before they are announced.
    pub durable: bool,
    /// Whether `NAME.verdict.json` is written.
    pub verdict_files: bool,
    /// Whether what cannot be written now is tried again.
    pub retries: bool,
    /// Where accepted files are published.
    pub gate: Option<PathBuf>,
    /// What is remembered.
    pub journal: Mutex<Journal>,
    /// Shared by those who write results where they belong; alone has it who removes one that lies
    /// where another file's may belong today.
    pub moving: RwLock<()>,
    /// Results that were written when other directories were watched, and the files they are of.
    pub elsewhere: Mutex<HashMap<PathBuf, Vec<Arc<Path>>>>,
    /// The epoch of who must judge: what was judged in an earlier one is not stored.
    pub epoch: AtomicU64,
}

impl Store {
    /// Pools, writes, publishes, records. The findings are taken out of the job.
    pub fn store(
        &self,
        job: &mut FinishedJob,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> StoreOutcome {
        if !refresh(job) {
            return StoreOutcome::Stale;
        }
        let outcomes: Vec<BundleOutcome> = job.bundles.iter_mut().map(taken).collect();
        let pooled = self.pool(job, outcomes, config, root);
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
        // The file may have gone between the look and the rename: nothing may lie there then.
        if stamp_through_links(&job.path).is_none() {
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
        if !refresh(job) {
            return StoreOutcome::Stale;
        }
        if self.retries && !failed.for_good {
            return StoreOutcome::Failed(failed.what + failed.further);
        }
        // As far as it goes: what lies there is not of these bytes.
        let _ = self.withdraw(&job.path, &[]);
        judged.verdict = Verdict::Undetermined;
        judged.why.insert(0, failed.what);
        judged.xqar = PathBuf::new();
        StoreOutcome::Stored(Box::new(judged))
    }

    fn pool(
        &self,
        job: &FinishedJob,
        bundles: Vec<BundleOutcome>,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> Pooled {
        let document = root.and_then(|bytes| Document::open(bytes).ok());
        let mut remarks: Vec<Remark> = unanswered(job).into_iter().collect();
        if let (Some(document), Some(prepared)) = (&document, &job.prepared) {
            remarks.extend(qcbus_ingest::remarks(document, &prepared.missing, &bundles));
        }
        let input = PoolInput {
            input_file: &to_text(&job.path),
            config,
            bundles,
            remarks,
            scope: Scope::Whole,
            version: env!("CARGO_PKG_VERSION"),
            build_date: BUILD_DATE,
        };
        match document {
            Some(document) => pool::pool(input, &mut InDocument { document }),
            None => pool::pool(input, &mut NoPlaces),
        }
    }

    fn write(&self, job: &FinishedJob, pooled: &Pooled, judged: &Judged) -> Result<(), Unwritten> {
        let fail = |path: &Path, error: &io::Error| Unwritten {
            what: format!("cannot write {}: {error}", to_text(path)),
            further: "; it is tried again",
            for_good: is_for_good(error),
        };
        let text = xqar::write(&pooled.results, self.dialect);
        let _others = self.moving.read().unwrap_or_else(PoisonError::into_inner);
        let verdict_path = self.places.verdict(&job.path);
        if self.gate.is_some() && judged.verdict != Verdict::Accepted {
            self.close_gate(&job.path)
                .map_err(|error| fail(&job.path, &error))?;
        }
        if self.verdict_files {
            // Whoever sees the new result sees its verdict.
            let verdict = crate::verdict_file::render(job, pooled, judged.verdict, &judged.xqar);
            let (verdict, result) = (
                (&*verdict_path, &*verdict),
                (&*judged.xqar, text.as_bytes()),
            );
            write_both(verdict, result, self.durable)
                .map_err(|(path, error)| fail(path, &error))?;
        } else {
            write_whole(&judged.xqar, text.as_bytes(), self.durable)
                .map_err(|error| fail(&judged.xqar, &error))?;
        }
        if judged.verdict == Verdict::Accepted {
            self.open_gate(&job.path, &judged.digest)
                .map_err(|error| fail(&job.path, &error))?;
        }
        reached("written", &job.path);
        let history = Some(Box::new(history(job, pooled)));
        let entry = Entry::Judged {
            path: job.path.clone(),
            judged: Arc::new(judged.clone()),
            history,
        };
        // What was written last lies at a place: files whose result lay there have none any more.
        let mut entries: Vec<Entry> = self.ousted(&judged.xqar);
        entries.push(entry);
        self.record(&entries).map_err(|what| Unwritten {
            what,
            further: "",
            for_good: false,
        })?;
        self.elsewhere().remove(&judged.xqar);
        Ok(())
    }

    fn ousted(&self, xqar: &Path) -> Vec<Entry> {
        let elsewhere = self.elsewhere();
        let ousted = elsewhere.get(xqar).into_iter().flatten();
        let withdrawn = |path: &Arc<Path>| Entry::Withdrawn {
            path: path.clone(),
            reporters: Vec::new(),
        };
        ousted.map(withdrawn).collect()
    }

    /// Whether the result of a file lies where it would not be written today.
    pub fn has_moved(&self, path: &Path, judged: &Judged) -> bool {
        !self.places.contains(path) || judged.xqar != self.places.xqar(path)
    }

    /// Remembers that the result of a file lies where it would not be written today.
    pub fn lies_elsewhere(&self, path: &Arc<Path>, judged: &Judged) {
        let mut elsewhere = self.elsewhere();
        let there = elsewhere.entry(judged.xqar.clone()).or_default();
        there.push(path.clone());
    }

    fn elsewhere(&self) -> MutexGuard<'_, HashMap<PathBuf, Vec<Arc<Path>>>> {
        self.elsewhere
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether everything that a verdict brings with it lies where it belongs.
    pub fn is_complete(&self, path: &Path, judged: &Judged) -> bool {
        let published = |gate: &PathBuf| {
            judged.verdict != Verdict::Accepted || gate.join(self.places.display(path)).exists()
        };
        !self.has_moved(path, judged)
            && judged.xqar.exists()
            && (!self.verdict_files || self.places.verdict(path).exists())
            && self.gate.as_ref().is_none_or(published)
    }

    /// Writes to the journal.
    ///
    /// # Errors
    /// What a person should know; the entries are not written then.
    pub fn record(&self, entries: &[Entry]) -> Result<(), String> {
        let written = self.journal().write(entries);
        written.map_err(|error| error.to_string())
    }

    /// Forgets the history of jobs older than `keep`.
    ///
    /// # Errors
    /// What a person should know.
    pub fn prune(&self, keep: std::time::Duration) -> Result<(), String> {
        let pruned = self.journal().prune(keep);
        pruned.map(|_| ()).map_err(|error| error.to_string())
    }

    /// Removes what was written for a file that has gone, and remembers who is to take back a
    /// report about it.
    ///
    /// # Errors
    /// What a person should know; it is to be tried again.
    pub fn withdraw(&self, path: &Arc<Path>, reporters: &[String]) -> Result<(), Trouble> {
        let fail = |error: io::Error| Trouble {
            what: format!("cannot withdraw the result of {}: {error}", to_text(path)),
            concerns_all: false,
        };
        let entry = Entry::Withdrawn {
            path: path.clone(),
            reporters: reporters.to_vec(),
        };
        let moved = self.place_elsewhere(path)?;
        let alone = moved
            .as_ref()
            .map(|_| self.moving.write().unwrap_or_else(PoisonError::into_inner));
        // Meanwhile another file may have taken it.
        if alone.is_some()
            && let Some(xqar) = self.place_elsewhere(path)?
        {
            self.withdraw_at(&xqar).map_err(fail)?;
        }
        if self.places.contains(path) {
            self.withdraw_files(path).map_err(fail)?;
        }
        self.record(&[entry]).map_err(Trouble::of_all)?;
        let mut elsewhere = self.elsewhere();
        if let Some(others) = moved.and_then(|xqar| elsewhere.get_mut(&xqar)) {
            others.retain(|other| other != path);
        }
        Ok(())
    }

    /// Where the result of a file was written, if that is not where it would be written today.
    fn place_elsewhere(&self, path: &Path) -> Result<Option<PathBuf>, Trouble> {
        let place = self.journal().place(path);
        let place = place.map_err(|error| Trouble::of_all(error.to_string()))?;
        let today = |xqar: &PathBuf| self.places.contains(path) && *xqar == self.places.xqar(path);
        Ok(place.filter(|xqar| !today(xqar)))
    }

    /// Removes a result that was written when other directories were watched, and what belongs
    /// to it.
    fn withdraw_at(&self, xqar: &Path) -> io::Result<()> {
        if let Some(shown) = self.places.shown_at(xqar) {
            if let Some(gate) = &self.gate {
                remove(&gate.join(&shown))?;
            }
            remove(&with_suffix(&self.places.out.join(shown), ".verdict.json"))?;
        }
        remove(xqar)
    }

    fn journal(&self) -> MutexGuard<'_, Journal> {
        self.journal.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn withdraw_files(&self, path: &Path) -> io::Result<()> {
        self.close_gate(path)?;
        remove(&self.places.xqar(path))?;
        remove(&self.places.verdict(path))
    }

    /// Publishes an accepted file: the very bytes that were checked, or nothing.
    fn open_gate(&self, path: &Path, digest: &Digest) -> io::Result<()> {
        let Some(gate) = &self.gate else {
            return Ok(());
        };
        let target = gate.join(self.places.display(path));
        let bytes = std::fs::read(path)?;
        if digest_of(&bytes) != *digest {
            // It has changed since; the new bytes get their own verdict.
            return remove(&target);
        }
        if std::fs::read(&target).is_ok_and(|there| there == bytes) {
            return Ok(());
        }
        // A copy of the bytes just compared, not a link: a hard link would follow a writer who
        // changes the file in place.
        write_whole(&target, &bytes, self.durable)
    }

    fn close_gate(&self, path: &Path) -> io::Result<()> {
        match &self.gate {
            Some(gate) => remove(&gate.join(self.places.display(path))),
            None => Ok(()),
        }
    }
}

/// Why something that is to be tried again could not be done.
#[derive(Debug)]
pub struct Trouble {
    /// For a person.
    pub what: String,
    /// It is not about one file: the journal cannot be written.
    pub concerns_all: bool,
}

impl Trouble {
    /// The journal cannot be written.
    pub fn of_all(what: String) -> Trouble {
        Trouble {
            what,
            concerns_all: true,
        }
    }
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

/// Whether everything that the verdict depends on is what it was when it was read. Stamps that
/// moved although the bytes are the same (another link to the file, other rights) are taken over.
fn refresh(job: &mut FinishedJob) -> bool {
    let Some(prepared) = &mut job.prepared else {
        return true;
    };
    let inputs = &prepared.inputs;
    let now: Option<Vec<Input>> = inputs.iter().map(as_it_is).collect();
    let Some(now) = now else {
        return false;
    };
    if now != *inputs {
        let prepared = Arc::make_mut(prepared);
        prepared.inputs = now;
        // They moved a moment ago, and may move again without telling.
        prepared.racy = true;
    }
    true
}

/// The input with its present stamp, if it still has the bytes that were read.
fn as_it_is(input: &Input) -> Option<Input> {
    let now = stamp_through_links(&input.path);
    let Some((read, digest)) = input.content else {
        return now.is_none().then(|| input.clone());
    };
    let now = now?;
    let same = now == read
        || (now.differs_in_ctime_only(&read)
            && std::fs::read(&input.path).is_ok_and(|bytes| digest_of(&bytes) == digest));
    same.then(|| Input {
        path: input.path.clone(),
        content: Some((now, digest)),
    })
}

fn digest_of(bytes: &[u8]) -> Digest {
    use sha2::{Digest as _, Sha256};
    Digest(Sha256::digest(bytes).into())
}

/// The remark that nobody could answer for the file: it cannot be read, or nobody checks its kind.
fn unanswered(job: &FinishedJob) -> Option<Remark> {
    let takes = |it: &ShareOutcome| {
        let catalogue = it.catalogue.as_ref();
        catalogue.is_some_and(|it| it.kinds.contains(&job.kind))
    };
    let (checker, description, open) = if let Some(why) = &job.unreadable {
        (
            "qcbus_file",
            "The file is whole and can be read.",
            why.clone(),
        )
    } else if job.bundles.iter().any(takes) {
        return None;
    } else {
        let kind = job.kind.as_str();
        let why = format!("no bundle that is running checks .{kind} files");
        ("qcbus_bundles", "A bundle checks files of this kind.", why)
    };
    Some(Remark {
        checker: checker.to_owned(),
        description: description.to_owned(),
        issue: None,
        open: Some(open),
    })
}

/// Reasons shown to a person; more than these are counted.
const REASONS: usize = 20;

/// What a person is told of a verdict: what keeps it open. Beside an error only what failed counts:
/// that the error kept others from looking goes without saying.
fn reasons(job: &FinishedJob, pooled: &Pooled, verdict: Verdict) -> Vec<String> {
    if let Some(open) = unanswered(job).and_then(|remark| remark.open) {
        return vec![open];
    }
    let told = |it: &&Unfinished| {
        verdict != Verdict::Rejected || matches!(it.ending, Ending::Failed { .. })
    };
    let open: Vec<&Unfinished> = pooled.open().filter(told).collect();
    let mut why: Vec<String> = open.iter().take(REASONS).map(ToString::to_string).collect();
    if open.len() > REASONS {
        why.push(format!("and {} more", open.len() - REASONS));
    }
    why
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
    Judged {
        job: job.job,
        verdict,
        digest: root.map(|(_, digest)| digest).unwrap_or_default(),
        basis: prepared.map(|it| it.basis).unwrap_or_default(),
        config: job.config,
        jury: job.jury.clone(),
        epoch: job.epoch,
        inputs: prepared.map(|it| it.inputs.clone()).unwrap_or_default(),
        racy: prepared.is_none_or(|it| it.racy),
        counts: [
            pooled.counts.errors,
            pooled.counts.warnings,
            pooled.counts.information,
        ],
        why,
        xqar,
    }
}

/// What a bundle said, taken out of the job: there can be megabytes of it.
fn taken(share: &mut ShareOutcome) -> BundleOutcome {
    let checkers = std::mem::take(&mut share.said.checkers);
    BundleOutcome {
        checkers,
        ..share.said.clone()
    }
}

fn history(job: &FinishedJob, pooled: &Pooled) -> History {
    let bundles = job.bundles.iter().map(|it| {
        (
            it.said.name.clone(),
            it.said.version.clone(),
            it.micros,
            it.failure.clone().unwrap_or_default(),
        )
    });
    let mut checkers = Vec::new();
    for bundle in &pooled.results.bundles {
        for checker in &bundle.checkers {
            let status = checker.status.unwrap_or(Status::Error);
            if status != Status::Completed || !checker.issues.is_empty() {
                let status = format!("{status:?}").to_lowercase();
                let issues = checker.issues.len() as u64;
                checkers.push((bundle.name.clone(), checker.id.clone(), status, issues));
            }
        }
    }
    History {
        bytes: job.prepared.as_ref().map_or(0, |it| it.bytes),
        micros: u64::try_from(job.elapsed.as_micros()).unwrap_or(u64::MAX),
        bundles: bundles.collect(),
        checkers,
    }
}

/// Finds the row and column of an XPath in the image.
struct InDocument<'a> {
    document: Document<'a>,
}

impl Resolver for InDocument<'_> {
    fn resolve(&mut self, xpath: &str) -> Option<pool::XPathPlace> {
        let nodes = self.document.evaluate(xpath).ok()?;
        let position = nodes.first()?.position();
        Some(pool::XPathPlace {
            row: position.row.into(),
            column: position.column.into(),
            offset: Some(position.offset.into()),
        })
    }
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;
    use crate::stamp::tests::put;

    fn rewrite(path: &Path, bytes: &[u8]) {
        // Before 1970, for good measure.
        put(path, bytes, UNIX_EPOCH - Duration::from_secs(1));
    }

    #[test]
    fn what_was_read_is_told_from_what_is_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.xodr");
        rewrite(&path, b"one");
        let stamp = || stamp_through_links(&path);
        let read = stamp().unwrap();
        let input = Input {
            path: path.as_path().into(),
            content: Some((read, digest_of(b"one"))),
        };
        assert_eq!(as_it_is(&input), Some(input.clone()));

        // Another link: the same bytes under a new stamp.
        let link = dir.path().join("link");
        let linked = std::iter::repeat_with(|| {
            let _ = std::fs::remove_file(&link);
            std::fs::hard_link(&path, &link).unwrap();
            stamp().unwrap()
        });
        let linked = { linked }.find(|it| *it != read).unwrap();
        let now = as_it_is(&input).unwrap();
        assert_eq!(now.content, Some((linked, digest_of(b"one"))));

        // Other bytes of the same size, with the time put back.
        rewrite(&path, b"two");
        assert_eq!(stamp().map(|it| it.mtime_ns), Some(read.mtime_ns));
        assert_eq!(as_it_is(&input), None);

        std::fs::remove_file(&path).unwrap();
        assert_eq!(as_it_is(&input), None);
        let absent = Input {
            content: None,
            ..input
        };
        assert_eq!(as_it_is(&absent), Some(absent.clone()));
        rewrite(&path, b"two");
        assert_eq!(as_it_is(&absent), None);
    }
}

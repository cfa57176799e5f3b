//! Reconciliation at the start: makes the disk, the journal and the valid verdicts agree before any
//! file is judged. A broker may have been killed between writing a result and recording it. The
//! journal may have been moved away, and the watched directories may have changed.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_disk::{FileFingerprint, remove, remove_empty_above};
use qcbus_messages::Digest;
use qcbus_messages::path_text::to_text;
use qcbus_types::{Input, Judged, Stamp};
use qcbus_watch::hidden_above;
use qcbus_watch::stamp::{stamp_of, stamp_through_links};

use super::leftovers::{Leftover, leftovers};
use super::refresh::as_it_is;
use super::{Store, StoreFailure};
use crate::gate::GateError;
use crate::journal::{Entry, Remembered};
use crate::result_paths::verdict_beside;

/// Result of the reconciliation.
#[derive(Debug, Default)]
pub struct Reconciled {
    /// Files with valid verdicts.
    pub standing: Vec<Remembered>,
    /// Accepted files that are not behind the gate.
    pub unpublished: Vec<Arc<Path>>,
    /// Current stamps of all files that verdicts depend on.
    pub stamps: BTreeMap<Arc<Path>, Option<Stamp>>,
    /// Messages for the user.
    pub said: Vec<String>,
    /// For files with inconclusive stamps: whether they still have the bytes that were read.
    reread: HashMap<(Arc<Path>, Digest), bool>,
}

/// Reason why a result is no longer valid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Fall {
    /// The file of the result is no longer watched.
    Unwatched,
    /// The result would now be written to another path.
    Moved,
    /// The result is incomplete, or differs from the one in the journal.
    Incomplete,
}

impl Store {
    /// Removes invalid results from the disk and records this. `reporters` are those that may have
    /// sent reports about results that are not in the journal.
    ///
    /// # Errors
    /// When the gate cannot be cleared.
    pub fn reconcile(
        &self,
        rows: Vec<Remembered>,
        reporters: &[String],
    ) -> Result<Reconciled, GateError> {
        let mut found = Reconciled::default();
        let mut fallen: Vec<(Remembered, Fall)> = Vec::new();
        let (mut owned, mut publications) = (HashSet::new(), Vec::new());
        for row in rows {
            if let Some(fall) = self.fall_of(&row) {
                fallen.push((row, fall));
                continue;
            }
            owned.extend(row.judged.xqar.clone());
            self.is_written(&row);
            // If the file cannot be accessed now, its state is unknown and its result is kept.
            let lookable = stamp_of(&row.path);
            let as_read = found.as_read(&row.judged, lookable.as_ref().ok());
            if as_read || !row.judged.is_accepted() {
                publications.push(row.clone());
            }
            if lookable.is_ok() {
                found.standing.push(row);
            }
        }
        if let Some(gate) = &self.gate {
            found.unpublished = gate.take_over(&publications)?;
        }
        self.let_fall(fallen, &owned, reporters, &mut found);
        self.clear_leftovers(&owned, reporters, &mut found);
        Ok(found)
    }

    /// Registers the outputs of a file, so that their loss is noticed.
    fn is_written(&self, row: &Remembered) {
        let outputs = [self.places.xqar(&row.path), self.places.verdict(&row.path)];
        for output in outputs {
            if let Some(fingerprint) = FileFingerprint::at(&output) {
                self.outputs.written(&output, &row.path, fingerprint);
            }
        }
    }

    fn fall_of(&self, row: &Remembered) -> Option<Fall> {
        let (path, judged) = (&row.path, &row.judged);
        let directory = path.parent();
        let hidden = directory.and_then(|it| hidden_above(&self.places.roots, it));
        if !self.places.contains(path) || hidden.is_some() {
            return Some(Fall::Unwatched);
        }
        // A result that could not be written is tried again.
        let xqar = judged.xqar.as_deref();
        let Some(xqar) = xqar.filter(|it| *it == self.places.xqar(path)) else {
            return Some(Fall::Moved);
        };
        let now = FileFingerprint::at(&self.places.verdict(path));
        // Results of older versions have no recorded fingerprint.
        let same = now.is_some() && (row.written.is_none() || row.written == now);
        (!same || !xqar.exists()).then_some(Fall::Incomplete)
    }

    /// Removes results, and records the removal and the reporters that must withdraw reports. A
    /// result outside of this broker's directory stays, with the reports next to it: only the
    /// broker that holds the lock of a directory removes files in it. The journal may name such a
    /// result if the state was copied from another broker, or if results went elsewhere before.
    fn let_fall(
        &self,
        fallen: Vec<(Remembered, Fall)>,
        owned: &HashSet<PathBuf>,
        reporters: &[String],
        found: &mut Reconciled,
    ) {
        let mut entries = Vec::new();
        let mut by_reason: BTreeMap<Fall, Vec<Arc<Path>>> = BTreeMap::new();
        let mut foreign_results = BTreeSet::new();
        for (row, fall) in fallen {
            let xqar = row.judged.xqar.as_ref();
            if let Some(foreign) = xqar.filter(|xqar| !self.places.owns(xqar)) {
                foreign_results.insert(directory_of(foreign));
                entries.push(Entry::Withdrawn {
                    path: row.path,
                    reporters: Vec::new(),
                });
                continue;
            }
            // The result of another file may be at this path by now.
            let xqar = xqar.filter(|xqar| !owned.contains(*xqar));
            let mine = xqar.is_some();
            if let Some(error) = xqar.and_then(|xqar| self.remove_result(xqar).err()) {
                found.cannot_withdraw(&row.path, &error);
                continue;
            }
            // A reporter may have written its report, but the broker ended before recording it.
            let delivered = row.delivered.into_iter().map(|(name, _)| name);
            let all: BTreeSet<String> = delivered.chain(reporters.iter().cloned()).collect();
            let reporters = all.into_iter().filter(|_| mine).collect();
            if row.judged.is_written() {
                by_reason.entry(fall).or_default().push(row.path.clone());
            }
            entries.push(Entry::Withdrawn {
                path: row.path,
                reporters,
            });
        }
        self.recorded(&entries, found);
        for (fall, paths) in by_reason {
            found.said.push(said(fall, &paths));
        }
        if !foreign_results.is_empty() {
            found
                .said
                .push(left_alone(&foreign_results, &self.places.out));
        }
    }

    /// Removes results of this program that the journal does not contain.
    fn clear_leftovers(
        &self,
        owned: &HashSet<PathBuf>,
        reporters: &[String],
        found: &mut Reconciled,
    ) {
        let known: HashSet<&Path> = found.standing.iter().map(|row| &*row.path).collect();
        let mut entries = Vec::new();
        let mut removed: Vec<Arc<Path>> = Vec::new();
        let mut failed = Vec::new();
        for Leftover { path, xqar } in leftovers(&self.places.out, owned) {
            if let Err(error) = self.remove_result(&xqar) {
                failed.push((path, error));
                continue;
            }
            // If the file has a verdict, its reports belong to that verdict.
            if !known.contains(&*path) {
                entries.push(Entry::Left {
                    path: path.clone(),
                    xqar,
                    reporters: reporters.to_vec(),
                });
            }
            removed.push(path);
        }
        for (path, error) in failed {
            found.cannot_withdraw(&path, &error);
        }
        self.recorded(&entries, found);
        if !removed.is_empty() {
            let results = some_of(&removed);
            let out = to_text(&self.places.out);
            found.said.push(format!(
                "results removed from {out}, because the journal does not contain them: those of {results}"
            ));
        }
    }

    /// Removes a result, and last the verdict file, which shows that a result existed.
    fn remove_result(&self, xqar: &Path) -> io::Result<()> {
        remove(xqar)?;
        verdict_beside(xqar).map_or(Ok(()), |verdict| remove(&verdict))?;
        remove_empty_above(xqar, &self.places.out);
        Ok(())
    }

    fn recorded(&self, entries: &[Entry], found: &mut Reconciled) {
        if entries.is_empty() {
            return;
        }
        // The next start finds the same state and tries again.
        if let Err(why) = self.record(entries).map_err(StoreFailure::of_all) {
            found.said.push(why.what);
        }
    }
}

impl Reconciled {
    /// Returns a reconciliation without valid verdicts. `said` contains messages for the user.
    pub fn nothing(said: Vec<String>) -> Reconciled {
        Reconciled {
            said,
            ..Reconciled::default()
        }
    }

    /// Checks whether all inputs of a verdict are unchanged since they were read. `root` is the
    /// result of `stat` for the file itself, if it can be accessed.
    fn as_read(&mut self, judged: &Judged, root: Option<&Option<Stamp>>) -> bool {
        let mut same = true;
        for (number, input) in judged.inputs.iter().enumerate() {
            let now = match (number, root) {
                (0, None) => continue,
                (0, Some(stamp)) => *stamp,
                _ => *self
                    .stamps
                    .entry(input.path.clone())
                    .or_insert_with(|| stamp_through_links(&input.path)),
            };
            let read = input.content.stamp();
            same &= now == read || self.has_same_bytes(input, now);
        }
        same
    }

    /// Checks whether an input has the same bytes, even after a change of links or permissions.
    fn has_same_bytes(&mut self, input: &Input, now: Option<Stamp>) -> bool {
        let (Some((read, digest)), Some(now)) = (input.content.read(), now) else {
            return false;
        };
        let key = (input.path.clone(), digest);
        now.differs_in_ctime_only(&read)
            && *self
                .reread
                .entry(key)
                .or_insert_with(|| as_it_is(input).is_some())
    }

    fn cannot_withdraw(&mut self, path: &Path, error: &io::Error) {
        let path = to_text(path);
        self.said.push(format!(
            "cannot withdraw the result of {path}: {error}; it is retried at the next start of qcbus"
        ));
    }
}

fn said(fall: Fall, paths: &[Arc<Path>]) -> String {
    let why = match fall {
        Fall::Unwatched => "their files are not watched any more",
        Fall::Moved => "results of these directories are now written to another place",
        Fall::Incomplete => "they were not complete, and their files are judged again",
    };
    format!("results withdrawn: {}: {why}", some_of(paths))
}

fn directory_of(xqar: &Path) -> PathBuf {
    xqar.parent().unwrap_or(xqar).to_path_buf()
}

/// Returns the message about results that the journal names outside of this broker's directory of results.
fn left_alone(directories: &BTreeSet<PathBuf>, out: &Path) -> String {
    let directories: Vec<Arc<Path>> = directories.iter().map(|it| it.as_path().into()).collect();
    format!(
        "results in {} are left alone: the journal lists them, but this broker only writes to {}. The state was \
         copied from another broker, or --out was changed; remove them only if no other broker writes there",
        some_of(&directories),
        to_text(out)
    )
}

/// Returns the first few paths and the number of the others.
fn some_of(paths: &[Arc<Path>]) -> String {
    const SHOWN: usize = 3;
    let shown = paths.iter().take(SHOWN);
    let shown: Vec<String> = shown.map(|path| to_text(path)).collect();
    match paths.len().saturating_sub(SHOWN) {
        0 => shown.join(", "),
        more => format!("{} and {more} more", shown.join(", ")),
    }
}

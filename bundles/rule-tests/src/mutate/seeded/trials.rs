//! Tries all entries with existing files, on all processors.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::mutate::{Changed, Overlay, Said, apply, in_parallel, new_ones, said};
use qcbus_sdk::Plan;

use super::Study;
use super::judge::{Trial, judge};
use super::table::{Entry, Original};

/// Producers among the shared cases.
const SHARED: [&str; 3] = ["esmini", "scenario_runner", "qc-framework"];

/// Results of the entries.
#[derive(Default)]
pub struct Trials<'e> {
    pub done: Vec<Trial<'e>>,
    /// Entries with missing files.
    pub skipped: Vec<&'e Entry>,
    /// Errors of entries that could not be tried.
    pub errors: Vec<String>,
}

impl Study<'_> {
    /// Tries the given entries.
    pub(super) fn try_all<'e>(&self, entries: &[&'e Entry]) -> Trials<'e> {
        let plan = Plan::by_default(self.bundle);
        let (there, skipped) = entries
            .iter()
            .partition::<Vec<&Entry>, _>(|entry| self.directory(&entry.original).is_some());
        let originals: BTreeSet<&Original> = there.iter().map(|entry| &entry.original).collect();
        let originals: Vec<&Original> = originals.into_iter().collect();
        let before = in_parallel(&originals, |overlays: &mut Overlays, original| {
            self.said(overlays, &plan, original, &Changed::new())
        });
        let before: BTreeMap<&Original, _> = originals.iter().copied().zip(before).collect();
        let tried = in_parallel(&there, |overlays: &mut Overlays, entry| {
            let before = before[&entry.original].as_ref();
            before
                .map_err(String::clone)
                .and_then(|before| self.trial(overlays, &plan, entry, before))
                .map_err(|error| format!("{}: {error}", entry.id))
        });
        let mut trials = Trials {
            skipped,
            ..Trials::default()
        };
        for trial in tried {
            match trial {
                Ok(trial) => trials.done.push(trial),
                Err(error) => trials.errors.push(error),
            }
        }
        trials
    }

    /// Returns the directory of the producer if the file exists.
    fn directory(&self, original: &Original) -> Option<PathBuf> {
        let above = if SHARED.contains(&original.producer.as_str()) {
            self.shared.to_owned()
        } else {
            PathBuf::from(std::env::var_os(self.fetched)?)
        };
        let directory = above.join(&original.producer);
        directory.join(&original.path).exists().then_some(directory)
    }

    fn trial<'e>(
        &self,
        overlays: &mut Overlays,
        plan: &Plan,
        entry: &'e Entry,
        before: &[Said],
    ) -> Result<Trial<'e>, String> {
        let source = self.directory(&entry.original).ok_or("not available")?;
        let (changed, spots) = apply(&entry.edits, &entry.at, &source)?;
        let after = self.said(overlays, plan, &entry.original, &changed)?;
        Ok(judge(entry, spots, new_ones(before, after)))
    }

    fn said(
        &self,
        overlays: &mut Overlays,
        plan: &Plan,
        original: &Original,
        changed: &Changed,
    ) -> Result<Vec<Said>, String> {
        let producer = &original.producer;
        if !overlays.0.contains_key(producer) {
            let source = self.directory(original).ok_or("not available")?;
            let overlay = Overlay::of(&source).map_err(|error| error.to_string())?;
            overlays.0.insert(producer.clone(), overlay);
        }
        let all = overlays.0[producer].with(changed, |root| said(plan, root, &original.path));
        all.map_err(|error| error.to_string())?
    }
}

/// State of one thread: its overlays by producer.
#[derive(Default)]
struct Overlays(BTreeMap<String, Overlay>);

impl<'e> Trials<'e> {
    /// Splits the results into faults, harmless variants and errors.
    pub fn split(self) -> (Trials<'e>, Trials<'e>, Vec<String>) {
        let (mut faults, mut harmless) = (Trials::default(), Trials::default());
        let is_fault = |entry: &Entry| entry.level.is_some();
        (faults.done, harmless.done) = self.done.into_iter().partition(|it| is_fault(it.entry));
        (faults.skipped, harmless.skipped) = self.skipped.into_iter().partition(|it| is_fault(it));
        (faults, harmless, self.errors)
    }
}

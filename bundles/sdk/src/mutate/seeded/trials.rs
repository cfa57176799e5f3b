//! Tries all entries whose files are at hand, on all processors.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::Plan;
use crate::mutate::{Changed, Overlay, Said, apply, in_parallel, new_ones, said};

use super::Study;
use super::judge::{Trial, judge};
use super::table::{Entry, Original};

/// Producers among the shared cases.
const SHARED: [&str; 3] = ["esmini", "scenario_runner", "qc-framework"];

/// What came of the entries.
#[derive(Default)]
pub struct Trials<'e> {
    pub done: Vec<Trial<'e>>,
    /// Their files are not at hand.
    pub skipped: Vec<&'e Entry>,
    /// What could not be tried.
    pub errors: Vec<String>,
}

impl Study<'_> {
    /// Tries entries.
    pub(super) fn try_all<'e>(&self, entries: &[&'e Entry]) -> Trials<'e> {
        let plan = Plan::by_default(self.bundle);
        let (there, skipped) = entries
            .iter()
            .partition::<Vec<&Entry>, _>(|entry| self.directory(&entry.original).is_some());
        let originals: BTreeSet<&Original> = there.iter().map(|entry| &entry.original).collect();
        let originals: Vec<&Original> = originals.into_iter().collect();
        let before = in_parallel(&originals, |cli: &mut Cli, original| {
            self.said(cli, &plan, original, &Changed::new())
        });
        let before: BTreeMap<&Original, _> = originals.iter().copied().zip(before).collect();
        let tried = in_parallel(&there, |cli: &mut Cli, entry| {
            let before = before[&entry.original].as_ref();
            before
                .map_err(String::clone)
                .and_then(|before| self.trial(cli, &plan, entry, before))
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

    /// The directory of the producer, when the file is at hand.
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
        cli: &mut Cli,
        plan: &Plan,
        entry: &'e Entry,
        before: &[Said],
    ) -> Result<Trial<'e>, String> {
        let source = self.directory(&entry.original).ok_or("not at hand")?;
        let (changed, spots) = apply(&entry.edits, &entry.at, &source)?;
        let after = self.said(cli, plan, &entry.original, &changed)?;
        Ok(judge(entry, spots, new_ones(before, after)))
    }

    fn said(
        &self,
        cli: &mut Cli,
        plan: &Plan,
        original: &Original,
        changed: &Changed,
    ) -> Result<Vec<Said>, String> {
        let producer = &original.producer;
        if !cli.0.contains_key(producer) {
            let source = self.directory(original).ok_or("not at hand")?;
            let overlay = Overlay::of(&source).map_err(|error| error.to_string())?;
            cli.0.insert(producer.clone(), overlay);
        }
        let all = cli.0[producer].with(changed, |root| said(plan, root, &original.path));
        all.map_err(|error| error.to_string())?
    }
}

/// What one thread works with.
#[derive(Default)]
struct Cli(BTreeMap<String, Overlay>);

impl<'e> Trials<'e> {
    /// Faults, harmless variants and what could not be tried.
    pub fn split(self) -> (Trials<'e>, Trials<'e>, Vec<String>) {
        let (mut faults, mut harmless) = (Trials::default(), Trials::default());
        let is_fault = |entry: &Entry| entry.level.is_some();
        (faults.done, harmless.done) = self.done.into_iter().partition(|it| is_fault(it.entry));
        (faults.skipped, harmless.skipped) = self.skipped.into_iter().partition(|it| is_fault(it));
        (faults, harmless, self.errors)
    }
}

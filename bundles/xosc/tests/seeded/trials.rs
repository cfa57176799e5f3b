//! Tries all entries whose files are at hand, on all processors.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use qcbus_sdk::Plan;
use qcbus_sdk::mutate::{Changed, Overlay, Said, apply, in_parallel, new_ones, said};
use qcbus_xosc::BUNDLE;

use super::judge::{Trial, judge};
use super::table::{Entry, Scenario};

const SHARED: [&str; 3] = ["esmini", "scenario_runner", "qc-framework"];
const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/cases/real");

/// What came of the entries.
#[derive(Default)]
pub struct Trials<'e> {
    pub done: Vec<Trial<'e>>,
    /// Their files are not at hand.
    pub skipped: Vec<&'e Entry>,
    /// What could not be tried.
    pub errors: Vec<String>,
}

/// Tries them.
pub fn try_all<'e>(entries: &[&'e Entry]) -> Trials<'e> {
    let plan = Plan::by_default(&BUNDLE);
    let (there, skipped) = entries
        .iter()
        .partition::<Vec<&Entry>, _>(|entry| entry.scenario.at_hand().is_some());
    let originals: BTreeSet<&Scenario> = there.iter().map(|entry| &entry.scenario).collect();
    let originals: Vec<&Scenario> = originals.into_iter().collect();
    let before = in_parallel(&originals, |desk: &mut Desk, scenario| {
        desk.said(&plan, scenario, &Changed::new())
    });
    let before: BTreeMap<&Scenario, _> = originals.iter().copied().zip(before).collect();
    let tried = in_parallel(&there, |desk: &mut Desk, entry| {
        let before = before[&entry.scenario].as_ref();
        before
            .map_err(String::clone)
            .and_then(|before| desk.trial(&plan, entry, before))
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

impl Scenario {
    fn at_hand(&self) -> Option<PathBuf> {
        let directory = if SHARED.contains(&self.producer.as_str()) {
            Path::new(CASES).join(&self.producer)
        } else {
            Path::new(&std::env::var_os("QCBUS_SCENARIOS")?).join(&self.producer)
        };
        directory.join(&self.path).exists().then_some(directory)
    }
}

/// What one thread works with.
#[derive(Default)]
struct Desk(BTreeMap<String, Overlay>);

impl Desk {
    fn trial<'e>(
        &mut self,
        plan: &Plan,
        entry: &'e Entry,
        before: &[Said],
    ) -> Result<Trial<'e>, String> {
        let source = entry.scenario.at_hand().ok_or("not at hand")?;
        let (changed, spots) = apply(&entry.edits, &entry.at, &source)?;
        let after = self.said(plan, &entry.scenario, &changed)?;
        Ok(judge(entry, spots, new_ones(before, after)))
    }

    fn said(
        &mut self,
        plan: &Plan,
        scenario: &Scenario,
        changed: &Changed,
    ) -> Result<Vec<Said>, String> {
        let producer = &scenario.producer;
        if !self.0.contains_key(producer) {
            let source = scenario.at_hand().ok_or("not at hand")?;
            let overlay = Overlay::of(&source).map_err(|error| error.to_string())?;
            self.0.insert(producer.clone(), overlay);
        }
        let all = self.0[producer].with(changed, |root| said(plan, root, &scenario.path));
        all.map_err(|error| error.to_string())?
    }
}

//! Reports of trials: the verdicts that would change if a shadow judged as well.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use qcbus_messages::Verdict;
use qcbus_messages::control::{Trial, TrialCounts};
use qcbus_types::TrialEnd;

use crate::State;

/// Maximum number of trials that are listed individually.
const TOLD: usize = 1000;

impl State {
    /// Returns the trial counts of a bundle, or `None` if it is not a shadow.
    pub(crate) fn trial_counts(&self, name: &str) -> Option<TrialCounts> {
        let shadow = self.trials.shadows.get(name)?;
        let mut counts = TrialCounts {
            tried: shadow.tried.len() as u64,
            waiting: (shadow.waiting.len() + usize::from(shadow.under_way.is_some())) as u64,
            ..TrialCounts::default()
        };
        for trial in shadow.tried.iter().filter_map(|it| self.told(it)) {
            match (&trial.failure, trial.would) {
                (Some(_), _) => counts.failed += 1,
                (None, would) if would == trial.verdict => {}
                (None, Verdict::Rejected) => counts.would_reject += 1,
                (None, Verdict::Undetermined) => counts.would_leave_open += 1,
                (None, Verdict::Accepted) => counts.would_accept += 1,
            }
        }
        Some(counts)
    }

    /// Returns the trials of a shadow that change a verdict, failed or have findings. Returns
    /// `None` if the shadow does not exist.
    pub fn trials(&self, name: &str) -> Option<(TrialCounts, Vec<Trial>)> {
        let counts = self.trial_counts(name)?;
        let tried = self.trials.shadows.get(name)?.tried.iter();
        let told = tried.filter_map(|it| self.told(it));
        let of_interest = |it: &Trial| {
            it.failure.is_some()
                || it.would != it.verdict
                || it.errors + it.warnings + it.information > 0
        };
        let mut told: Vec<Trial> = told.filter(of_interest).collect();
        // Failures and changes come first, each sorted by path.
        told.sort_by_key(|it| (it.failure.is_none(), it.would == it.verdict));
        told.truncate(TOLD);
        Some((counts, told))
    }

    fn told(&self, (path, end): (&Arc<Path>, &Result<TrialEnd, String>)) -> Option<Trial> {
        let entry = self.files.get(self.files.id(path)?)?;
        let verdict = entry.judged.as_ref()?.verdict;
        let mut trial = Trial {
            file: path.to_path_buf(),
            verdict,
            would: verdict,
            errors: 0,
            warnings: 0,
            information: 0,
            why: Vec::new(),
            failure: None,
            result: PathBuf::new(),
        };
        match end {
            Ok(found) => {
                [trial.errors, trial.warnings, trial.information] = found.counts;
                trial.why.clone_from(&found.why);
                trial.result = found.result.clone().unwrap_or_default();
                trial.would = match self.requirements(entry.kind).is_empty() {
                    true => found.alone,
                    false => verdict.and(found.adds),
                };
            }
            Err(why) => trial.failure = Some(why.clone()),
        }
        Some(trial)
    }
}

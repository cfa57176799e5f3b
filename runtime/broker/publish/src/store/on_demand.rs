//! Result of an on-demand check: pooled like any other, but not written to the disk.

use std::path::PathBuf;
use std::sync::atomic::Ordering;

use qcbus_formats::config::Config;
use qcbus_formats::pool::{BundleOutcome, Pooled, Scope};
use qcbus_formats::xqar;
use qcbus_messages::control::{self, Checked};
use qcbus_types::{FinishedJob, OnDemandOutcome, Referenced, TaskOutcome, file_verdict};

use super::pooling::reasons;
use super::{Store, judged, unlooked};

impl Store {
    /// Pools the findings of an on-demand check.
    pub fn pool_on_demand(
        &self,
        job: &mut FinishedJob,
        config: Option<&Config>,
        root: Option<&[u8]>,
    ) -> OnDemandOutcome {
        let pooled = match self.pool_as_it_is(job, (config, Scope::Whole), root) {
            Ok(pooled) => pooled,
            Err(outcome) => return outcome,
        };
        let verdict = pooled.verdict();
        let why = reasons(job, &pooled, verdict);
        let judged = judged(job, &pooled, verdict, why, PathBuf::new());
        if self.epoch.load(Ordering::Acquire) != job.epoch.0 {
            return OnDemandOutcome::Outdated;
        }
        let referenced = |it: &Referenced| control::Referenced {
            file: it.path.to_path_buf(),
            digest: it.digest.to_string(),
        };
        let prepared = job.prepared.iter();
        let rests_on = prepared.flat_map(|it| &it.rests_on);
        OnDemandOutcome::Pooled(Box::new(Checked {
            verdict: file_verdict(&job.path, &judged),
            result: xqar::write(&pooled.results, self.dialect),
            rests_on: rests_on.map(referenced).collect(),
        }))
    }

    /// Pools the findings, unless an input has changed since it was read.
    pub(super) fn pool_as_it_is(
        &self,
        job: &mut FinishedJob,
        config: (Option<&Config>, Scope),
        root: Option<&[u8]>,
    ) -> Result<Pooled, OnDemandOutcome> {
        match self.refresh(job) {
            Ok(true) => {}
            Ok(false) => return Err(OnDemandOutcome::Stale),
            Err(error) => return Err(OnDemandOutcome::Failed(unlooked(&job.path, &error))),
        }
        let outcomes: Vec<BundleOutcome> = job.bundles.iter().map(TaskOutcome::said).collect();
        Ok(self.pool(job, outcomes, config, root))
    }
}

//! Suspects: after a death every job that the bundle had is tried alone. Only a pair of file and
//! bundle that fails twice alone in a fresh process is given up.

use super::State;
use super::jobs::ShareState;

/// Deaths of a bundle, alone with a file in a fresh process, until it is not tried again.
const STRIKES: u8 = 2;

impl State {
    /// Takes the jobs of a session that has ended back into the bundle's queue. After a death
    /// each of them is under suspicion.
    pub(super) fn take_back(&mut self, name: &str, died: bool) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        for (id, _) in std::mem::take(&mut bundle.active).into_iter().rev() {
            let Some(job) = self.jobs.get_mut(&id) else {
                continue;
            };
            let Some(share) = job.shares.get_mut(name) else {
                continue;
            };
            if let ShareState::Sent { alone_and_fresh } = share.state
                && died
            {
                share.strikes += u8::from(alone_and_fresh);
                share.suspect = true;
            }
            share.unstage();
            share.state = ShareState::Queued;
            if share.suspect {
                bundle.suspects.push_front(id);
            } else {
                bundle.queue.put_back(id, job.errand.is_some());
            }
        }
    }

    /// Pairs of file and bundle that have had all their chances end here.
    pub(super) fn condemn(&mut self, name: &str, why: &str) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let mut over = Vec::new();
        for id in bundle.suspects.iter().copied() {
            if let Some(share) = self
                .jobs
                .get_mut(&id)
                .and_then(|job| job.shares.get_mut(name))
                && share.strikes >= STRIKES
            {
                share.state = ShareState::Failed(format!(
                    "{name} failed {STRIKES} times on this file alone in a fresh process: {why}"
                ));
                over.push(id);
            }
        }
        bundle.suspects.retain(|id| !over.contains(id));
        for id in over {
            self.finish_if_over(id);
        }
    }
}

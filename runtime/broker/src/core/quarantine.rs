//! Suspects: after a death every job that the bundle had is tried alone. Only a pair of file and
//! bundle that fails twice alone in a fresh process is given up.

use super::State;
use super::jobs::TaskState;

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
            let Some(task) = job.tasks.get_mut(name) else {
                continue;
            };
            if let TaskState::Sent { alone_and_fresh } = task.state
                && died
            {
                task.strikes += u8::from(alone_and_fresh);
                task.quarantined = true;
            }
            task.unstage();
            task.state = TaskState::Queued;
            if task.quarantined {
                bundle.quarantine.push_front(id);
            } else {
                bundle.queue.put_back(id, job.on_demand.is_some());
            }
        }
    }

    /// Pairs of file and bundle that have had all their chances end here.
    pub(super) fn condemn(&mut self, name: &str, why: &str) {
        let Some(bundle) = self.bundles.get_mut(name) else {
            return;
        };
        let mut over = Vec::new();
        for id in bundle.quarantine.iter().copied() {
            if let Some(task) = self
                .jobs
                .get_mut(&id)
                .and_then(|job| job.tasks.get_mut(name))
                && task.strikes >= STRIKES
            {
                task.state = TaskState::Failed(format!(
                    "{name} failed {STRIKES} times on this file alone in a fresh process: {why}"
                ));
                over.push(id);
            }
        }
        bundle.quarantine.retain(|id| !over.contains(id));
        for id in over {
            self.finish_if_over(id);
        }
    }
}

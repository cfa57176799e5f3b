//! Quarantine: after the death of a bundle each of its jobs is retried alone. A pair of file and
//! bundle is given up only if it fails twice, alone in a new process.

use super::State;
use super::jobs::TaskState;

/// Number of deaths, alone with a file in a new process, after which the pair is given up.
const STRIKES: u8 = 2;

impl State {
    /// Returns the jobs of an ended session to the bundle's queue. After a death each of them is quarantined.
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

    /// Fails the pairs of file and bundle that have used all their retries.
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
                    "{name} failed {STRIKES} times in a new process with only this file: {why}; the file is checked again \
                     when it, the bundle or the configuration changes"
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

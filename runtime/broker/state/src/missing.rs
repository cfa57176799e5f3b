//! Missing required bundles: how long the broker waits for them, and when their tasks of a job fail.

use std::collections::BTreeSet;
use std::time::Duration;

use qcbus_messages::JobId;
use qcbus_types::Origin;

use super::State;
use super::bundles::Bundle;
use super::jobs::TaskState;

impl State {
    /// Fails the tasks of bundles that are missing and will not join in time.
    pub(super) fn fail_missing(&mut self) {
        let names: BTreeSet<String> = self
            .jobs
            .values()
            .flat_map(|job| job.tasks.iter())
            .filter(|(_, task)| task.state == TaskState::Queued)
            .map(|(name, _)| name.clone())
            .collect();
        for name in names {
            if let Some(why) = self.hopeless(&name) {
                self.fail_queued(&name, &why);
            }
        }
    }

    /// Returns the reason why waiting for this bundle is useless, or `None` if it is not.
    pub(super) fn hopeless(&self, name: &str) -> Option<String> {
        let Some(bundle) = self.bundles.get(name) else {
            let text = format!("the configuration requires {name}, which has not joined");
            return (!self.child_is_coming(name)).then_some(text);
        };
        if let Some(why) = self.is_flapping(name, bundle) {
            return Some(why);
        }
        let away = self.away_for(bundle)?;
        let note = &bundle.note;
        if let Some(why) = self.child_cannot_start(name) {
            Some(format!("{name} cannot be started: {why}"))
        } else if self.child_gave_up(name) {
            Some(format!(
                "{name} keeps failing and is temporarily not started: {note}"
            ))
        } else if away < self.patience_with(name) {
            None
        } else if bundle.origin == Some(Origin::Joined) {
            Some(format!(
                "{name} is not available: {note}; if it is no longer required, run `qcbus bundle remove {name}`"
            ))
        } else {
            Some(format!("{name} is not available: {note}"))
        }
    }

    /// Returns how long to wait for a missing bundle. A bundle with a slow start has its whole start limit.
    fn patience_with(&self, name: &str) -> Duration {
        let child = self.children.get(name);
        let slow = child.filter(|it| it.spec.slow_start && self.child_is_coming(name));
        let limit = self.settings.absence_limit;
        slow.map_or(limit, |it| it.start_limit().max(limit))
    }

    fn fail_queued(&mut self, name: &str, why: &str) {
        if let Some(bundle) = self.bundles.get_mut(name) {
            bundle.queue.clear();
            bundle.quarantine.clear();
        }
        let ids: Vec<JobId> = self.jobs.keys().copied().collect();
        for id in ids {
            let task = self
                .jobs
                .get_mut(&id)
                .and_then(|job| job.tasks.get_mut(name))
                .filter(|task| task.state == TaskState::Queued);
            if let Some(task) = task {
                task.state = TaskState::Failed(why.to_owned());
                task.missing = true;
                self.finish_if_over(id);
            }
        }
    }

    /// Returns how long a bundle has been missing, or `None` if it is connected.
    pub(super) fn away_for(&self, bundle: &Bundle) -> Option<Duration> {
        let since = bundle.away_since.filter(|_| bundle.session.is_none())?;
        Some(self.now.saturating_sub(since))
    }
}

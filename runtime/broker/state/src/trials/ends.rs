//! Trials that end early: for a job that needs the bundle, or because the broker stops.

use qcbus_messages::JobId;

use crate::{Actions, State};

impl State {
    /// Ends the trials if a job finds no room on the bus.
    pub(crate) fn trials_give_way(&mut self, to: JobId, actions: &mut Actions) {
        let is_trial = self.jobs.get(&to).is_some_and(|job| job.is_trial());
        if !is_trial {
            self.end_trials(actions);
        }
    }

    /// Ends all active trials. Their files are queued again.
    pub(crate) fn end_trials(&mut self, actions: &mut Actions) {
        let names: Vec<String> = self.trials.shadows.keys().cloned().collect();
        for name in names {
            self.end_trial_of(&name, actions);
        }
    }

    pub(super) fn end_trial_of(&mut self, name: &str, actions: &mut Actions) {
        let shadow = self.trials.shadows.get(name);
        let under_way = shadow.and_then(|it| it.under_way.as_ref());
        if let Some((request_id, _)) = under_way.cloned() {
            self.put_trial_back(request_id);
            self.abandon(request_id, actions);
        }
    }
}

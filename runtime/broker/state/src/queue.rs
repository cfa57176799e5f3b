//! Queue of the jobs that wait for a bundle.

use std::collections::VecDeque;

use qcbus_messages::JobId;

/// Jobs that wait for a bundle, in order within each kind. On-demand checks come first, but other
/// jobs take every second turn. Thus a steady flow of requests cannot block the other jobs.
#[derive(Debug, Default)]
pub(super) struct Queue {
    on_demand_checks: VecDeque<JobId>,
    others: VecDeque<JobId>,
    /// The last job that was taken was an on-demand check.
    was_on_demand: bool,
}

impl Queue {
    /// Appends a job.
    pub fn push(&mut self, id: JobId, is_on_demand: bool) {
        self.of(is_on_demand).push_back(id);
    }

    /// Puts a job back to its former position at the front.
    pub fn put_back(&mut self, id: JobId, is_on_demand: bool) {
        self.of(is_on_demand).push_front(id);
    }

    /// Takes the next job.
    pub fn pop(&mut self) -> Option<JobId> {
        let mut kinds = [!self.was_on_demand, self.was_on_demand].into_iter();
        let (id, is_on_demand) = kinds.find_map(|kind| Some((self.of(kind).pop_front()?, kind)))?;
        self.was_on_demand = is_on_demand;
        Some(id)
    }

    /// Takes this job if it is in the queue.
    pub fn take(&mut self, id: JobId) -> Option<JobId> {
        [&mut self.on_demand_checks, &mut self.others]
            .into_iter()
            .find_map(|queue| {
                let at = queue.iter().position(|it| *it == id)?;
                queue.remove(at)
            })
    }

    /// Removes all jobs.
    pub fn clear(&mut self) {
        self.on_demand_checks.clear();
        self.others.clear();
    }

    /// Returns the number of jobs.
    pub fn len(&self) -> usize {
        self.on_demand_checks.len() + self.others.len()
    }

    /// Checks whether the queue is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    fn of(&mut self, is_on_demand: bool) -> &mut VecDeque<JobId> {
        match is_on_demand {
            true => &mut self.on_demand_checks,
            false => &mut self.others,
        }
    }
}

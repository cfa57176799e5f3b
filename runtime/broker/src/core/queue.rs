//! The jobs that wait for a bundle.

use std::collections::VecDeque;

use qcbus_messages::JobId;

/// Jobs that wait for a bundle, each kind in its order. Errands come before what nobody waits for, and never twice in
/// a row, so that nothing else waits for ever while clients ask and ask.
#[derive(Debug, Default)]
pub(super) struct Queue {
    on_demand_checks: VecDeque<JobId>,
    others: VecDeque<JobId>,
    /// The last that was taken was an errand.
    was_on_demand: bool,
}

impl Queue {
    /// Puts a job at the end.
    pub fn push(&mut self, id: JobId, is_on_demand: bool) {
        self.of(is_on_demand).push_back(id);
    }

    /// Puts a job where it was before it was taken.
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

    /// Takes this job, if it is there.
    pub fn take(&mut self, id: JobId) -> Option<JobId> {
        [&mut self.on_demand_checks, &mut self.others]
            .into_iter()
            .find_map(|queue| {
                let at = queue.iter().position(|it| *it == id)?;
                queue.remove(at)
            })
    }

    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.on_demand_checks.clear();
        self.others.clear();
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.on_demand_checks.len() + self.others.len()
    }

    /// Whether there are none.
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

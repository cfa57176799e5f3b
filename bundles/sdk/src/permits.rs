//! How many threads may check at the same time in this process.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// The hands of a process: as many threads check at the same time, and no more. Every job has one;
/// what no job has is lent to large jobs, and given back as soon as another job waits.
#[derive(Debug)]
pub struct Permits {
    count: usize,
    state: Mutex<State>,
    changed: Condvar,
    /// Free hands that no job waits for, readable without the lock. May be outdated.
    to_spare: AtomicUsize,
    /// Jobs that wait, likewise.
    wanted: AtomicUsize,
}

#[derive(Debug)]
struct State {
    free: usize,
    wanted: usize,
}

/// One of the [`Permits`], until it is dropped.
#[derive(Debug)]
pub struct Permit<'h>(&'h Permits);

impl Permits {
    /// More threads than this help nobody, and are a slip of the finger.
    pub const MOST: usize = 1024;

    /// That many hands, one of which is taken: that of the thread which checks.
    pub fn new(count: usize) -> Permits {
        let permits = Permits::idle(count);
        std::mem::forget(permits.take());
        permits
    }

    /// That many hands, none of which is taken.
    pub(crate) fn idle(count: usize) -> Permits {
        let count = count.clamp(1, Permits::MOST);
        let permits = Permits {
            count,
            state: Mutex::new(State {
                free: count,
                wanted: 0,
            }),
            changed: Condvar::new(),
            to_spare: AtomicUsize::new(0),
            wanted: AtomicUsize::new(0),
        };
        permits.tell(&permits.lock());
        permits
    }

    /// As many as this process may use processors: the affinity of its threads and the quota of its
    /// control groups are respected. To be asked before the process is confined.
    pub fn available() -> usize {
        std::thread::available_parallelism().map_or(1, usize::from)
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Takes a hand for a job, and waits for it.
    pub(crate) fn take(&self) -> Permit<'_> {
        let mut state = self.lock();
        state.wanted += 1;
        self.tell(&state);
        while state.free == 0 {
            state = self
                .changed
                .wait(state)
                .unwrap_or_else(PoisonError::into_inner);
        }
        state.free -= 1;
        state.wanted -= 1;
        self.tell(&state);
        Permit(self)
    }

    /// A hand that is free and that no job waits for.
    pub(crate) fn spare(&self) -> Option<Permit<'_>> {
        if self.to_spare.load(Ordering::Relaxed) == 0 {
            return None;
        }
        let mut state = self.lock();
        if state.free <= state.wanted {
            return None;
        }
        state.free -= 1;
        self.tell(&state);
        Some(Permit(self))
    }

    /// Waits for other threads, and lends the own hand meanwhile.
    pub(crate) fn wait_for<T>(&self, others: impl FnOnce() -> T) -> T {
        drop(Permit(self));
        // Whatever becomes of them, this thread goes on with a hand.
        let done = catch_unwind(AssertUnwindSafe(others));
        std::mem::forget(self.take());
        done.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// Whether a job waits for a hand.
    pub(crate) fn are_wanted(&self) -> bool {
        self.wanted.load(Ordering::Relaxed) > 0
    }

    fn tell(&self, state: &State) {
        let to_spare = state.free.saturating_sub(state.wanted);
        self.to_spare.store(to_spare, Ordering::Relaxed);
        let unmet = state.wanted.saturating_sub(state.free);
        self.wanted.store(unmet, Ordering::Relaxed);
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Permit<'_> {
    fn drop(&mut self) {
        let mut state = self.0.lock();
        state.free += 1;
        self.0.tell(&state);
        drop(state);
        self.0.changed.notify_one();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_that_a_job_waits_for_is_lent_to_nobody() {
        let permits = Permits::idle(2);
        let first = permits.take();
        let lent = permits.spare().unwrap();
        assert!(permits.spare().is_none());
        std::thread::scope(|scope| {
            let job = scope.spawn(|| {
                let _own = permits.take();
                assert!(permits.spare().is_none());
            });
            while !permits.are_wanted() {
                std::thread::yield_now();
            }
            assert!(permits.spare().is_none());
            drop(lent);
            job.join().unwrap();
        });
        assert!(!permits.are_wanted());
        assert!(permits.spare().is_some());
        drop(first);
    }

    #[test]
    fn there_is_always_one_hand_and_never_too_many() {
        assert_eq!(Permits::new(0).count(), 1);
        assert_eq!(Permits::new(usize::MAX).count(), Permits::MOST);
        assert!(Permits::new(1).spare().is_none(), "the only one is taken");
        assert!(Permits::available() >= 1);
    }
}

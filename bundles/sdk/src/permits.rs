//! Limit on the number of threads that check at the same time in this process.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Permits of a process: the number of threads that may check at the same time. Every job holds
/// one. Large jobs borrow free permits and return them as soon as another job waits.
#[derive(Debug)]
pub struct Permits {
    count: usize,
    state: Mutex<State>,
    changed: Condvar,
    /// Number of free permits that no job waits for, readable without the lock. It may be outdated.
    to_spare: AtomicUsize,
    /// Number of waiting jobs without a free permit, readable without the lock. It may be outdated.
    wanted: AtomicUsize,
}

#[derive(Debug)]
struct State {
    free: usize,
    wanted: usize,
}

/// One of the [`Permits`]; dropping it returns it.
#[derive(Debug)]
pub struct Permit<'h>(&'h Permits);

impl Permits {
    /// Maximum number of threads. A larger number is useless and probably a typing error.
    pub const MOST: usize = 1024;

    /// Creates that many permits. The calling thread holds one of them.
    pub fn new(count: usize) -> Permits {
        let permits = Permits::idle(count);
        std::mem::forget(permits.take());
        permits
    }

    /// Creates that many permits, all of them free.
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

    /// Returns the number of processors that this process may use. CPU affinity and cgroup quota
    /// are respected. It must be called before the process enters the sandbox.
    pub fn available() -> usize {
        std::thread::available_parallelism().map_or(1, usize::from)
    }

    /// Returns the number of permits.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Takes a permit for a job, and waits until one is free.
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

    /// Returns a permit that is free and that no job waits for.
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

    /// Waits for other threads, and lends the permit of this thread meanwhile.
    pub(crate) fn wait_for<T>(&self, others: impl FnOnce() -> T) -> T {
        drop(Permit(self));
        // This thread takes a permit again even if the other threads panic.
        let done = catch_unwind(AssertUnwindSafe(others));
        std::mem::forget(self.take());
        done.unwrap_or_else(|panic| resume_unwind(panic))
    }

    /// Checks whether a job waits for a permit.
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
    fn awaited_permit_is_not_lent() {
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
    fn permit_count_is_at_least_one_and_bounded() {
        assert_eq!(Permits::new(0).count(), 1);
        assert_eq!(Permits::new(usize::MAX).count(), Permits::MOST);
        assert!(
            Permits::new(1).spare().is_none(),
            "the only permit is taken"
        );
        assert!(Permits::available() >= 1);
    }
}

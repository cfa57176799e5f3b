//! Probe threads that access files of others, for callers that must not wait for ever.

use std::collections::VecDeque;
use std::io;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use qcbus_disk::foreign::IoWatchdog;
use qcbus_environment::{is_simulated, spawn_blocking};

/// Maximum time for an answer of the system about a file. A disk that spins up needs less. A
/// missing disk never answers.
pub const PATIENCE: Duration = Duration::from_secs(10);

/// Number of idle threads that are kept.
const RESERVE: usize = 4;

/// Runs file accesses on probe threads. Threads that do not return in time are abandoned.
#[derive(Debug, Clone)]
pub struct Probes {
    io_watchdog: Arc<IoWatchdog>,
    orders: Arc<Orders>,
    next: Arc<AtomicU64>,
    patience: Duration,
}

impl Default for Probes {
    fn default() -> Probes {
        Probes::new(Arc::default(), PATIENCE)
    }
}

type Work = Box<dyn FnOnce() + Send>;

#[derive(Default)]
struct Orders {
    waiting: Mutex<Waiting>,
    more: Condvar,
}

impl std::fmt::Debug for Orders {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Orders").finish_non_exhaustive()
    }
}

#[derive(Default)]
struct Waiting {
    works: VecDeque<(u64, Work)>,
    idle: usize,
}

impl Probes {
    /// Creates an empty set of threads. `io_watchdog` monitors them and abandons them after `patience`.
    pub fn new(io_watchdog: Arc<IoWatchdog>, patience: Duration) -> Probes {
        Probes {
            io_watchdog,
            orders: Arc::default(),
            // Jobs are owners, too. Their numbers never reach this range.
            next: Arc::new(AtomicU64::new(1 << 63)),
            patience,
        }
    }

    /// Runs a file access on a thread. The returned number identifies its owner for the I/O
    /// watchdog.
    ///
    /// # Errors
    /// When no thread can be started.
    pub fn send(&self, work: impl FnOnce() + Send + 'static) -> io::Result<u64> {
        let owner = self.next.fetch_add(1, Ordering::Relaxed);
        if is_simulated() {
            spawn_blocking(work);
            return Ok(owner);
        }
        let mut waiting = self.orders.lock();
        if waiting.idle <= waiting.works.len() {
            let (io_watchdog, orders) = (self.io_watchdog.clone(), self.orders.clone());
            std::thread::Builder::new()
                .name("probe".to_owned())
                .spawn(move || orders.serve(&io_watchdog))?;
        }
        waiting.works.push_back((owner, Box::new(work)));
        drop(waiting);
        self.orders.more.notify_one();
        Ok(owner)
    }

    /// Runs a file access on a thread and waits for its result as long as the system answers.
    ///
    /// # Errors
    /// [`io::ErrorKind::TimedOut`] when the system does not answer. A later result is dropped.
    pub fn within<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> io::Result<T> {
        if is_simulated() {
            return Ok(work());
        }
        let (tell, told) = channel();
        let owner = self.send(move || {
            // If the caller has given up, the receiver is gone.
            let _ = tell.send(work());
        })?;
        loop {
            match told.recv_timeout(self.patience) {
                Ok(found) => return Ok(found),
                Err(RecvTimeoutError::Timeout) => {
                    if self.io_watchdog.is_given_up(owner, self.patience) {
                        return Err(io::Error::new(io::ErrorKind::TimedOut, NO_ANSWER));
                    }
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(io::Error::other("the file lookup failed"));
                }
            }
        }
    }
}

const NO_ANSWER: &str = "a file that it depends on has not responded for too long";

impl Orders {
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn serve(&self, io_watchdog: &Arc<IoWatchdog>) {
        while let Some((owner, work)) = self.next() {
            let _attendance = io_watchdog.attend(owner);
            work();
        }
    }

    /// Waits for the next work item. Returns `None` if enough threads are idle.
    fn next(&self) -> Option<(u64, Work)> {
        let mut waiting = self.lock();
        loop {
            if let Some(work) = waiting.works.pop_front() {
                return Some(work);
            }
            if waiting.idle >= RESERVE {
                return None;
            }
            waiting.idle += 1;
            waiting = self
                .more
                .wait(waiting)
                .unwrap_or_else(PoisonError::into_inner);
            waiting.idle -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;
    use std::process::Command;
    use std::time::Instant;

    use qcbus_disk::foreign;

    use super::*;

    #[test]
    fn probes_return_their_results() {
        let probes = Probes::default();
        for number in 0..100 {
            assert_eq!(probes.within(move || number * 2).unwrap(), number * 2);
        }
        let slow = probes.clone();
        let many = std::thread::scope(|scope| {
            let all: Vec<_> = (0..20)
                .map(|number| {
                    let slow = &slow;
                    scope.spawn(move || slow.within(move || number).unwrap())
                })
                .collect();
            all.into_iter().map(|it| it.join().unwrap()).sum::<i32>()
        });
        assert_eq!(many, 190);
    }

    #[test]
    fn hanging_probe_is_given_up() {
        let dir = tempfile::tempdir().unwrap();
        let pipe = dir.path().join("pipe");
        assert!(
            Command::new("mkfifo")
                .arg(&pipe)
                .status()
                .unwrap()
                .success()
        );
        let io_watchdog = Arc::new(IoWatchdog::default());
        let probes = Probes::new(io_watchdog.clone(), Duration::from_millis(50));
        let at = pipe.clone();
        // A visit opens no pipe, so this reads one directly to block like a missing disk.
        let lost = probes.within(move || foreign::access(&at, || std::fs::read(&at)));
        assert_eq!(lost.unwrap_err().kind(), io::ErrorKind::TimedOut);
        assert_eq!(io_watchdog.hanging(), std::slice::from_ref(&pipe));
        let found = probes.within(|| Path::new("/").is_dir());
        assert!(found.unwrap(), "other probes continue");
        std::fs::write(&pipe, "at last").unwrap();
        let begun = Instant::now();
        while !io_watchdog.hanging().is_empty() {
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "watchdog timeout"
            );
            std::thread::yield_now();
        }
    }

    #[test]
    fn slow_probe_without_file_access_is_not_given_up() {
        let probes = Probes::new(Arc::default(), Duration::from_millis(1));
        let slow = probes.within(|| std::thread::sleep(Duration::from_millis(20)));
        assert!(slow.is_ok());
    }
}

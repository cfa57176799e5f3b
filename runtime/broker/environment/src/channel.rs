//! Channels between threads, as in [`std::sync::mpsc`].

use std::fmt;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{self, RecvError, RecvTimeoutError, SendError, TryRecvError};
use std::time::{Duration, Instant};

use crate::simulation::{Signal, Simulation, current};

/// Returns both ends of a channel without a limit.
pub fn channel<T>() -> (Sender<T>, Receiver<T>) {
    let (sender, receiver) = mpsc::channel();
    let signal = Signal::default();
    (Sender(sender, signal.clone()), Receiver(receiver, signal))
}

/// Sends values; see [`mpsc::Sender`].
pub struct Sender<T>(mpsc::Sender<T>, Signal);

impl<T> fmt::Debug for Sender<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<T> Clone for Sender<T> {
    fn clone(&self) -> Sender<T> {
        Sender(self.0.clone(), self.1.clone())
    }
}

impl<T> Sender<T> {
    /// Sends a value. It does not block.
    ///
    /// # Errors
    /// The value, if the receiver is gone.
    pub fn send(&self, value: T) -> Result<(), SendError<T>> {
        self.1.store(true, Ordering::Relaxed);
        self.0.send(value)
    }
}

impl<T> Drop for Sender<T> {
    fn drop(&mut self) {
        // This may have been the last sender.
        self.1.store(true, Ordering::Relaxed);
    }
}

/// Receives values; see [`mpsc::Receiver`].
pub struct Receiver<T>(mpsc::Receiver<T>, Signal);

impl<T> fmt::Debug for Receiver<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<T> Receiver<T> {
    /// Returns a value that has arrived.
    ///
    /// # Errors
    /// If no value has arrived, or all senders are gone.
    pub fn try_recv(&self) -> Result<T, TryRecvError> {
        self.0.try_recv()
    }

    /// Waits for a value.
    ///
    /// # Errors
    /// If all senders are gone.
    pub fn recv(&self) -> Result<T, RecvError> {
        match current().filter(|it| it.is_thread()) {
            // Without a limit of time, only the end of all senders ends the wait without a value.
            Some(simulation) => self.receive(&*simulation, None).map_err(|_| RecvError),
            None => self.0.recv(),
        }
    }

    /// Waits for a value, at most for this time.
    ///
    /// # Errors
    /// If the time is over, or all senders are gone.
    pub fn recv_timeout(&self, timeout: Duration) -> Result<T, RecvTimeoutError> {
        match current().filter(|it| it.is_thread()) {
            Some(simulation) => {
                let until = simulation.now() + timeout;
                self.receive(&*simulation, Some(until))
            }
            None => self.0.recv_timeout(timeout),
        }
    }

    fn receive(
        &self,
        simulation: &dyn Simulation,
        until: Option<Instant>,
    ) -> Result<T, RecvTimeoutError> {
        simulation.pause();
        loop {
            self.1.store(false, Ordering::Relaxed);
            match self.0.try_recv() {
                Ok(value) => return Ok(value),
                Err(TryRecvError::Disconnected) => return Err(RecvTimeoutError::Disconnected),
                Err(TryRecvError::Empty) if until.is_some_and(|it| simulation.now() >= it) => {
                    return Err(RecvTimeoutError::Timeout);
                }
                Err(TryRecvError::Empty) => simulation.wait(&self.1, until),
            }
        }
    }
}

//! Being woken by another process, on tokio.

use std::os::fd::{AsRawFd, RawFd};
use std::time::Duration;

use iceoryx2::prelude::FileDescriptorBased;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use crate::ports::WakeListener;

/// How long a lost wake-up can last.
pub(crate) const TICK: Duration = Duration::from_millis(20);

struct ListenerFd(WakeListener);

impl AsRawFd for ListenerFd {
    #[expect(
        unsafe_code,
        reason = "iceoryx2 hands out its descriptor only this way"
    )]
    fn as_raw_fd(&self) -> RawFd {
        // SAFETY: the descriptor belongs to the listener, which lives as long as `self`, and is
        // neither closed nor read from through this handle, only waited on.
        unsafe { self.0.file_descriptor().native_handle() }
    }
}

#[expect(unsafe_code, reason = "tokio asks for a descriptor that stays valid")]
fn register(listener: ListenerFd) -> std::io::Result<AsyncFd<ListenerFd>> {
    // SAFETY: `as_raw_fd` gives the same descriptor every time, and it is open until the listener
    // is dropped, which only happens together with the registration.
    let registered = unsafe { AsyncFd::register_with_interest(listener, Interest::READABLE) };
    registered.map_err(Into::into)
}

/// A listener whose descriptor tokio watches.
pub(crate) struct Waker {
    fd: AsyncFd<ListenerFd>,
}

impl Waker {
    /// Registers with the runtime that this is called in.
    ///
    /// # Errors
    /// When there is no runtime with I/O enabled, or the descriptor cannot be watched.
    pub(crate) fn new(listener: WakeListener) -> std::io::Result<Waker> {
        Ok(Waker {
            fd: register(ListenerFd(listener))?,
        })
    }

    /// Returns when somebody has notified, or after `limit`. Cancel-safe.
    pub(crate) async fn wait(&self, limit: Duration) {
        let woken = tokio::time::timeout(limit, self.fd.readable()).await;
        // The descriptor must be empty before readiness is cleared. It is emptied after a
        // timeout as well: that heals a wake-up whose readiness got lost.
        self.empty();
        match woken {
            Ok(Ok(mut guard)) => guard.clear_ready(),
            Ok(Err(error)) => {
                tracing::warn!(%error, "cannot wait for a wake-up; looking every {TICK:?} instead");
                tokio::time::sleep(limit).await;
            }
            Err(_) => {}
        }
    }

    /// One `try_wait` may leave notifications behind, and with them a readiness that never fires
    /// again; hence until there is nothing left. Bounded, because a peer may notify without end.
    fn empty(&self) {
        for _ in 0..1024 {
            match self.fd.get_ref().0.try_wait(|_| {}) {
                Ok(count) if count > 0 => {}
                _ => return,
            }
        }
    }
}

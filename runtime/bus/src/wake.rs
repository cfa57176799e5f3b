//! Wake-ups by another process, on tokio.

use std::os::fd::{AsRawFd, RawFd};
use std::time::Duration;

use iceoryx2::prelude::FileDescriptorBased;
use tokio::io::Interest;
use tokio::io::unix::AsyncFd;

use crate::ports::WakeListener;

/// Maximum delay after a lost wake-up.
pub(crate) const TICK: Duration = Duration::from_millis(20);

struct ListenerFd(WakeListener);

impl AsRawFd for ListenerFd {
    #[expect(unsafe_code, reason = "iceoryx2 exposes its descriptor only this way")]
    fn as_raw_fd(&self) -> RawFd {
        // SAFETY: the descriptor belongs to the listener, which lives as long as `self`. Through
        // this handle it is only waited on, and neither closed nor read from.
        unsafe { self.0.file_descriptor().native_handle() }
    }
}

#[expect(unsafe_code, reason = "tokio requires a descriptor that stays valid")]
fn register(listener: ListenerFd) -> std::io::Result<AsyncFd<ListenerFd>> {
    // SAFETY: `as_raw_fd` returns the same descriptor every time. It is open until the listener is
    // dropped, which only happens together with the registration.
    let registered = unsafe { AsyncFd::register_with_interest(listener, Interest::READABLE) };
    registered.map_err(Into::into)
}

/// A listener whose descriptor tokio watches.
pub(crate) struct Waker {
    fd: AsyncFd<ListenerFd>,
}

impl Waker {
    /// Registers with the runtime in which it is called.
    ///
    /// # Errors
    /// Fails if there is no runtime with I/O enabled, or if the descriptor cannot be watched.
    pub(crate) fn new(listener: WakeListener) -> std::io::Result<Waker> {
        Ok(Waker {
            fd: register(ListenerFd(listener))?,
        })
    }

    /// Returns on a notification or after `limit`. Cancel-safe.
    pub(crate) async fn wait(&self, limit: Duration) {
        let woken = tokio::time::timeout(limit, self.fd.readable()).await;
        // The descriptor must be empty before readiness is cleared. It is also emptied after a
        // timeout, which repairs a wake-up with lost readiness.
        self.empty();
        match woken {
            Ok(Ok(mut guard)) => guard.clear_ready(),
            Ok(Err(error)) => {
                tracing::warn!(%error, "cannot wait for a wake-up; polling every {TICK:?} instead");
                tokio::time::sleep(limit).await;
            }
            Err(_) => {}
        }
    }

    /// Reads until no notification is left. One `try_wait` may leave some, and their readiness
    /// never fires again. The reads are limited, because a peer may notify without end.
    fn empty(&self) {
        for _ in 0..1024 {
            match self.fd.get_ref().0.try_wait(|_| {}) {
                Ok(count) if count > 0 => {}
                _ => return,
            }
        }
    }
}

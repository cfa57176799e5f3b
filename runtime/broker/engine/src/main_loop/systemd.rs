//! Messages to a service manager.

use super::Broker;

impl Broker {
    pub(super) fn notify_ready(&self, total: usize) {
        let status = format!("watching {total} files");
        notify(&[
            sd_notify::NotifyState::Ready,
            sd_notify::NotifyState::Status(&status),
        ]);
    }

    pub(super) fn notify_watchdog(&self) {
        let queue = self.state.status().queue;
        let status = format!("{} waiting, {} being checked", queue.waiting, queue.active);
        notify(&[
            sd_notify::NotifyState::Watchdog,
            sd_notify::NotifyState::Status(&status),
        ]);
    }

    pub(super) fn notify_stopping(&self) {
        notify(&[sd_notify::NotifyState::Stopping]);
    }
}

/// Notifies systemd if it has started this process.
fn notify(states: &[sd_notify::NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(states) {
        tracing::debug!("cannot notify systemd: {error}");
    }
}
